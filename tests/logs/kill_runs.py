#!/usr/bin/env python3
"""Kills runs (SIGKILL) at random moments and reads their logs: each must open, with all but the last 100 ms.

    kill_runs.py TETHER SCENARIO [--kills 100] [--at-once 8] [--seed 1] [--longest 10]

The runs are in real time, so that simulated time is that of the clock since the run began, and what a log lacks
can be told: it is the time of the kill less the last time in the log. A run that the machine does not let keep up
seems to lack more. Exit code 1 if a log can't be opened, or lacks more than 100 ms."""

import argparse
import concurrent.futures
import os
import random
import re
import subprocess
import sys
import tempfile
import time

LIMIT_S = 0.1


def kill_one(tether, scenario, folder, number, after):
    """Returns (what was wrong or '', seconds that the log lacks)."""
    log = os.path.join(folder, f"{number}.mcap")
    run = subprocess.Popen([tether, "run", scenario, "--realtime", "--log", log], stdout=subprocess.PIPE,
                           stderr=subprocess.DEVNULL)
    for line in run.stdout:
        if b"action_started" in line:
            break
    begin = time.monotonic()
    try:
        run.wait(timeout=after)
    except subprocess.TimeoutExpired:
        pass
    ran = time.monotonic() - begin
    run.kill()
    run.wait()
    check = subprocess.run([tether, "check", log], capture_output=True, text=True)
    found = re.search(r", seed \d+, ([0-9.]+) s, by tether", check.stdout)
    if check.returncode not in (0, 5) or not found:
        return f"killed after {ran:.3f} s: {check.stdout}{check.stderr}", 0.0
    size = os.path.getsize(log)
    os.unlink(log)
    return ("" if size > 0 else "it is empty"), ran - float(found.group(1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tether")
    parser.add_argument("scenario")
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--at-once", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--longest", type=float, default=10, help="the latest moment, in s")
    arguments = parser.parse_args()
    draw = random.Random(arguments.seed)
    moments = [draw.uniform(0, arguments.longest) for _ in range(arguments.kills)]
    lacking, wrong = [], 0
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(arguments.at_once) as pool:
        jobs = [pool.submit(kill_one, arguments.tether, arguments.scenario, folder, i, moment)
                for i, moment in enumerate(moments)]
        for job in jobs:
            problem, lacks = job.result()
            if problem:
                wrong += 1
                print(problem)
            else:
                lacking.append(lacks)
    lacking.sort()
    late = sum(lacks > LIMIT_S for lacks in lacking)
    print(f"{len(lacking)} of {arguments.kills} logs open; they lack {1e3 * lacking[len(lacking) // 2]:.0f} ms in the median, "
          f"{1e3 * lacking[-1]:.0f} ms at most; {late} lack more than {1e3 * LIMIT_S:.0f} ms")
    return 1 if wrong or late else 0


if __name__ == "__main__":
    sys.exit(main())
