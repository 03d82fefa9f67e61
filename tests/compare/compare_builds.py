#!/usr/bin/env python3
"""Compares what two builds of tether plan and run, for changes that must not change behaviour.

    compare_builds.py OLD NEW [--scenario FILE ...] [--seeds N] [--plan-only]

OLD and NEW are checkouts in which `./dev build` has been done. Every shipped scenario (or those given) is planned with all
its candidates, and run with seeds 1 to N. Reports are compared key by key; times, versions and paths don't count. Prints
each difference, and exits with 1 if there are any.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

IGNORED = {"tether", "timing", "wall_s", "optimize_s", "compile_s", "parse_s", "search_s", "total_s"}


def report_of(checkout, arguments):
    """Exit code, and the JSON report without what differs between any two processes."""
    program = pathlib.Path(checkout).resolve() / "build/release/bin/tether"
    environment = dict(os.environ, TETHER_DATA_DIR=str(pathlib.Path(checkout).resolve()))
    with tempfile.TemporaryDirectory() as folder:
        output = pathlib.Path(folder) / "report.json"
        done = subprocess.run(
            [program, *arguments, "--json", output], cwd=checkout, env=environment, capture_output=True, text=True
        )
        report = json.loads(output.read_text()) if output.exists() else {}
    return {"exit": done.returncode, "stderr": done.stderr, "report": strip(report)}


def strip(value):
    if isinstance(value, dict):
        return {key: strip(part) for key, part in value.items() if key not in IGNORED}
    if isinstance(value, list):
        return [strip(part) for part in value]
    return value


def differences(old, new, where=""):
    """Lines that name each place where two reports differ."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted(old.keys() | new.keys()):
            if key not in old or key not in new:
                yield f"{where}.{key}: only in the {'new' if key not in old else 'old'} report"
            else:
                yield from differences(old[key], new[key], f"{where}.{key}")
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield f"{where}: {len(old)} entries, now {len(new)}"
        for i, (a, b) in enumerate(zip(old, new)):
            yield from differences(a, b, f"{where}[{i}]")
    elif old != new:
        yield f"{where}: {old!r}, now {new!r}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--scenario", action="append", help="relative to the checkouts; default: all that ship")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--plan-only", action="store_true")
    options = parser.parse_args()
    scenarios = options.scenario or sorted(
        str(path.relative_to(options.new)) for path in pathlib.Path(options.new, "scenarios").glob("*.yaml")
    )
    jobs = [["plan", scenario, "--threads", "1"] for scenario in scenarios]
    if not options.plan_only:
        jobs += [["run", s, "--threads", "1", "--seed", str(n)] for s in scenarios for n in range(1, options.seeds + 1)]
    different = 0
    for job in jobs:
        found = list(differences(report_of(options.old, job), report_of(options.new, job)))
        print(("same      " if not found else "DIFFERENT ") + " ".join(job), flush=True)
        for line in found[:10]:
            print("    " + line)
        different += bool(found)
    print(f"{len(jobs)} compared, {different} different")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
