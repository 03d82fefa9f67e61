#!/usr/bin/env python3
"""Interrupts every command at random moments, and says what became of the process and of its outputs.

Usage: signal_moments.py TETHER [--moments N] [--seed N] [--command NAME]

Each command runs once whole, for its duration; then N times (default 200) with SIGINT and SIGTERM in turn at a moment drawn
uniformly from it. Right is: the process ends within 0.5 s of the signal, with exit code 130 (or with that of a whole run, where
the signal came too late; or by the signal, while the dynamic loader still works); its output file is absent or whole (JSON that
parses, or the format's last line); nothing else is left in its folder.
"""

import argparse
import json
import pathlib
import random
import signal
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
LONGEST_END = 0.5  # s
LOADER = 0.03  # s: before this a signal may end the process itself

FORMULA = "a U (b & " + "X " * 15 + "c)"


def commands(tether, folder):
    """Of every command: its arguments ('@' is the output file), and whether that file is JSON."""
    reach = str(ROOT / "scenarios/workspace_reach.yaml")
    for kind, objects in (("sort", "8"), ("bin", "6"), ("crowd", "100")):
        subprocess.run([tether, "generate", kind, "--objects", objects, "--seed", "2", "--output", str(folder / kind)],
                       check=True, stdout=subprocess.DEVNULL)
    task = ["task", str(folder / "sort/domain.pddl"), str(folder / "sort/problem.pddl"), "--max-plans", "5000"]
    return {
        "plan": (["plan", str(folder / "bin/scenario.yaml"), "--json", "@"], True),
        "run": (["run", reach, "--json", "@"], True),
        "check": (["check", str(folder / "crowd/scenario.yaml")], False),
        "task": (task + ["--json", "@"], True),
        "generate": (["generate", "reach", "--seed", "1", "--output", "@folder"], False),
        "campaign": (["campaign", "robustness", "--scenes", "12", "--output", "@"], False),
        "automaton": (["automaton", FORMULA, "--json", "@"], True),
        "bench table1": (["bench", "table1", "--json", "@"], True),
    }


def run_once(tether, arguments, folder, moment=None, sent=signal.SIGINT):
    """(exit code, seconds from the signal to the end, output path)."""
    output = folder / "out.json"
    words = [str(output) if w == "@" else str(folder / "made") if w == "@folder" else w for w in arguments]
    begin = time.monotonic()
    process = subprocess.Popen([tether] + words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
    waited = 0.0
    if moment is not None:
        time.sleep(max(0.0, moment - (time.monotonic() - begin)))
        if process.poll() is None:
            process.send_signal(sent)
        signalled = time.monotonic()
        try:
            process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        waited = time.monotonic() - signalled
    else:
        process.wait()
        waited = time.monotonic() - begin
    return process.returncode, waited, output


def trial(tether, arguments, is_json, whole_code, moment, sent):
    """What was wrong, in words (empty: nothing), the time until the end, and the exit code."""
    wrong = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        code, waited, output = run_once(tether, arguments, folder, moment, sent)
        by_signal = code == -sent and moment < LOADER
        if code not in (130, whole_code) and not by_signal:
            wrong.append(f"exit code {code}")
        if waited > LONGEST_END:
            wrong.append(f"ended after {waited:.2f} s")
        if output.exists():
            text = output.read_text()
            try:
                if is_json:
                    json.loads(text)
                elif not text.endswith("\n"):
                    wrong.append("output ends inside a line")
            except ValueError as error:
                wrong.append(f"output is not whole: {error}")
        left = [p.name for p in folder.iterdir() if p.name not in ("out.json", "made")]
        if left:
            wrong.append(f"left behind: {left}")
    return ", ".join(wrong), waited, code


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("tether")
    parser.add_argument("--moments", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--command")
    options = parser.parse_args()
    tether = str(pathlib.Path(options.tether).resolve())
    bad = 0
    made = tempfile.TemporaryDirectory()
    for name, (arguments, is_json) in commands(tether, pathlib.Path(made.name)).items():
        if options.command not in (None, name):
            continue
        with tempfile.TemporaryDirectory() as folder:
            whole_code, duration, _ = run_once(tether, arguments, pathlib.Path(folder))
        draw = random.Random(f"{options.seed} {name}")
        longest, codes, faults = 0.0, {}, 0
        for i in range(options.moments):
            moment = draw.uniform(0, min(duration, 4.0))
            sent = (signal.SIGINT, signal.SIGTERM)[i % 2]
            wrong, waited, code = trial(tether, arguments, is_json, whole_code, moment, sent)
            longest = max(longest, waited)
            codes[code] = codes.get(code, 0) + 1
            if wrong:
                faults += 1
                print(f"  {name}: {sent.name} after {moment:.3f} s: {wrong}")
        bad += faults
        print(f"{name}: {options.moments} moments of {duration:.2f} s, exit codes {codes} (whole run: {whole_code}), "
              f"longest until the end {longest:.2f} s, {faults} faults", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
