// Runs scenes with a log and has the logs judged by those who made MCAP and its schemas: @mcap/core reads them
// from the beginning and by their index, @foxglove/schemas and ajv judge every message.
//   node judge.mjs --modules DIR --tether PROGRAM SCENARIO…     runs, then judges
//   node judge.mjs --modules DIR LOG.mcap…                      judges
// DIR holds node_modules (tests/logs/package.json). Says "skipped: …" where there are none.
import { createRequire } from "node:module";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";

const inputs = [];
let modules = "";
let tether = "";
for (let i = 2; i < process.argv.length; ++i) {
  if (process.argv[i] === "--modules") modules = process.argv[++i];
  else if (process.argv[i] === "--tether") tether = process.argv[++i];
  else inputs.push(process.argv[i]);
}
const require = createRequire(path.resolve(modules, "judge.js"));
let mcap, foxglove, Ajv, zstd, crc32;
try {
  mcap = require("@mcap/core");
  foxglove = require("@foxglove/schemas/jsonschema");
  Ajv = require("ajv");
  zstd = require("fzstd");
  ({ crc32 } = require("@foxglove/crc"));
} catch (error) {
  console.log(`skipped: the judges are not installed under '${modules}' (./dev test installs them, with npm): ${error.code ?? error}`);
  process.exit(0);
}

// What a library warns of is a finding.
let findings = [];
for (const kind of ["warn", "error"]) console[kind] = (...text) => findings.push(`${kind}: ${text.join(" ")}`);
process.on("warning", (warning) => findings.push(`warning: ${warning}`));
const find = (text) => { if (findings.length < 20) findings.push(text); };

const decompressHandlers = { zstd: (bytes, size) => zstd.decompress(bytes, new Uint8Array(Number(size))) };
const Compiler = Ajv.default ?? Ajv;
const ajv = new Compiler({ strict: false, allErrors: true });

/** A schema without what is said for people. */
function bare(schema) {
  if (Array.isArray(schema)) return schema.map(bare);
  if (schema === null || typeof schema !== "object") return schema;
  const kept = Object.entries(schema).filter(([key, value]) =>
    !((key === "description" || key === "$comment") && typeof value === "string"));
  return Object.fromEntries(kept.sort(([a], [b]) => (a < b ? -1 : 1)).map(([key, value]) => [key, bare(value)]));
}

/** The schema that judges: Foxglove's own where the name is one of theirs. */
function judgeOf(record) {
  const own = JSON.parse(new TextDecoder().decode(record.data));
  if (record.encoding !== "jsonschema") find(`schema ${record.name} is in '${record.encoding}'`);
  if (!record.name.startsWith("foxglove.")) return ajv.compile(own);
  const published = foxglove[record.name.slice("foxglove.".length)];
  if (published === undefined) {
    find(`schema ${record.name} is not published`);
    return ajv.compile(own);
  }
  if (JSON.stringify(bare(own)) !== JSON.stringify(bare(published))) find(`schema ${record.name} is not as it is published`);
  return ajv.compile(published);
}

/** Record by record, as a program that reads a stream. */
function readStream(bytes) {
  const reader = new mcap.McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(bytes);
  const seen = { schemas: new Map(), channels: new Map(), counts: new Map(), messages: 0, frames: new Set(["world"]), drawn: new Set() };
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema" && !seen.schemas.has(record.id)) seen.schemas.set(record.id, judgeOf(record));
    if (record.type === "Channel") {
      if (!seen.schemas.has(record.schemaId)) find(`channel ${record.topic} comes before its schema`);
      seen.channels.set(record.id, record);
    }
    if (record.type === "Statistics") seen.statistics = record;
    if (record.type === "DataEnd") seen.dataCrc = record.dataSectionCrc;
    if (record.type === "Footer") seen.footer = record;
    if (record.type === "Unknown") find(`a record of unknown kind ${record.opcode}`);
    if (record.type === "Message") judgeMessage(record, seen);
  }
  if (!reader.done()) find("the stream reader does not come to an end");
  return seen;
}

function judgeMessage(record, seen) {
  const channel = seen.channels.get(record.channelId);
  const message = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(record.data));
  const judge = seen.schemas.get(channel.schemaId);
  if (!judge(message)) find(`${channel.topic} at ${record.logTime} ns: ${ajv.errorsText(judge.errors).slice(0, 300)}`);
  for (const transform of message.transforms ?? []) {
    seen.frames.add(transform.child_frame_id);
    seen.drawn.add(transform.parent_frame_id);
  }
  for (const entity of message.entities ?? []) seen.drawn.add(entity.frame_id);
  if (record.sequence !== (seen.counts.get(channel.topic) ?? 0)) find(`${channel.topic} has messages out of sequence`);
  seen.counts.set(channel.topic, (seen.counts.get(channel.topic) ?? 0) + 1);
  ++seen.messages;
}

/** By the index, as a program that jumps about. */
async function readIndexed(bytes) {
  const readable = { size: async () => BigInt(bytes.length), read: async (at, size) => bytes.subarray(Number(at), Number(at + size)) };
  const reader = await mcap.McapIndexedReader.Initialize({ readable, decompressHandlers });
  let messages = 0;
  let last = 0n;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    if (message.logTime < last) find("messages by the index are not in the order of time");
    last = message.logTime;
    ++messages;
  }
  const metadata = [];
  for await (const record of reader.readMetadata()) metadata.push(record);
  let attachments = 0;
  for await (const _ of reader.readAttachments()) ++attachments;
  return { messages, metadata, attachments, statistics: reader.statistics, topics: [...reader.channelsById.values()].map((c) => c.topic) };
}

function judgeChecksums(bytes, seen) {
  const data = bytes.lastIndexOf(Buffer.from([0x0f, 4, 0, 0, 0, 0, 0, 0, 0]));
  if (seen.dataCrc === 0 || crc32(bytes.subarray(0, data)) !== seen.dataCrc) find("the checksum of the data section is wrong");
  const summary = bytes.subarray(Number(seen.footer.summaryStart), bytes.length - 12);
  if (seen.footer.summaryCrc === 0 || crc32(summary) !== seen.footer.summaryCrc) find("the checksum of the index is wrong");
}

async function judge(file) {
  findings = [];
  const bytes = fs.readFileSync(file);
  let summary = "";
  try {
    const seen = readStream(bytes);
    judgeChecksums(bytes, seen);
    for (const frame of seen.drawn) if (!seen.frames.has(frame)) find(`frame '${frame}' has no transform`);
    const indexed = await readIndexed(bytes);
    for (const [what, count] of [["by the index", indexed.messages], ["by the statistics", Number(indexed.statistics.messageCount)]])
      if (count !== seen.messages) find(`${seen.messages} messages in the file, ${count} ${what}`);
    const origin = indexed.metadata.find((record) => record.name === "tether")?.metadata;
    for (const key of ["format", "tether", "seed", "scenario"]) if (!origin?.get(key)) find(`the metadata lack '${key}'`);
    for (const topic of ["/tf", "/tf_static", "/scene", "/joints", "/commands", "/contacts", "/margins", "/state", "/events", "/log", "/plan", "/robots", "/result"])
      if (!indexed.topics.includes(topic)) find(`there is no message of ${topic}`);
    const seconds = Number(indexed.statistics.messageEndTime) / 1e9;
    summary = `${seen.messages} messages, ${seconds.toFixed(1)} s, ${((60e-3 * bytes.length) / seconds).toFixed(0)} kB per simulated minute`;
  } catch (error) {
    findings.push(`cannot be read: ${error.stack ?? error}`);
  }
  console.log(`${path.basename(file)}: ${summary} ${findings.length === 0 ? "no error, no warning" : ""}`);
  for (const finding of findings) console.log(`  ${finding}`);
  return findings.length === 0;
}

let sound = true;
if (tether === "") {
  for (const file of inputs) sound = (await judge(file)) && sound;
} else {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "tether_judge_"));
  try {
    for (const scenario of inputs) {
      const log = path.join(folder, path.basename(scenario, ".yaml") + ".mcap");
      const run = spawnSync(tether, ["run", scenario, "--log", log], { encoding: "utf8" });
      // A run that missed its goal has a log too.
      if (run.status !== 0 && run.status !== 5) {
        console.log(`${scenario}: tether run ended with ${run.status}\n${run.stderr}`);
        sound = false;
      } else {
        sound = (await judge(log)) && sound;
      }
    }
  } finally {
    fs.rmSync(folder, { recursive: true, force: true });
  }
}
process.exit(sound ? 0 : 1);
