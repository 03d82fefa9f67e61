#!/usr/bin/env python3
"""Plans and runs scenes turned about their robot, which starts in the same posture.

    turned_scenes.py [--scenario FILE ...] [--angles N] [--seed N] [--plan-only] [--tether PROGRAM] [--json FILE]

Everything but the robot is turned about its base by 360/N degrees, N times (default 24). Prints one line per angle, and
per scenario how many were planned, and how many of these reach the goal. Exits with 1 if one that was planned does not.
"""
import argparse
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile

import yaml

DEFAULT = ["scenarios/workspace_reach.yaml", "scenarios/hanoi.yaml", "scenarios/stacking.yaml"]


def turn(entry, centre, angle):
    """Turns the pose of an object or region in the world; one with a parent goes along with that."""
    pose = entry.setdefault("pose", {})
    if "parent" in pose:
        return
    x, y, z = pose.get("position", [0, 0, 0])
    dx, dy = x - centre[0], y - centre[1]
    c, s = math.cos(angle), math.sin(angle)
    pose["position"] = [centre[0] + c * dx - s * dy, centre[1] + s * dx + c * dy, z]
    roll, pitch, yaw = pose.get("rpy", [0, 0, 0])
    pose["rpy"] = [roll, pitch, yaw + angle]  # the yaw is applied last


def write_turned(scenario, degrees, folder):
    """The scenario turned, in a folder with all that it refers to; the file's path."""
    document = yaml.safe_load(scenario.read_text())
    robot = next(iter(document["robots"].values()))
    centre = robot.get("base", {}).get("position", [0, 0, 0])
    for part in ("objects", "regions"):
        for entry in document.get(part, {}).values():
            turn(entry, centre, math.radians(degrees))
    beside = scenario.with_suffix("")
    if beside.is_dir():
        shutil.copytree(beside, folder / beside.name)
    turned = folder / scenario.name
    turned.write_text(yaml.safe_dump(document, sort_keys=False))
    return turned


def report_of(program, arguments, folder):
    output = folder / "report.json"
    done = subprocess.run([program, *arguments, "--threads", "1", "--json", output], capture_output=True, text=True)
    report = json.loads(output.read_text()) if output.exists() else {}
    return done.returncode, report, done.stderr.strip()


def measure(options, scenario, degrees):
    record = {"scenario": scenario.stem, "degrees": degrees, "planned": False, "reached": False}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        turned = write_turned(scenario, degrees, folder)
        plan = folder / "plan.json"
        code, report, said = report_of(options.tether, ["plan", turned, "--output", plan], folder)
        record["planned"] = code == 0
        record["motion_s"] = report.get("timing", {}).get("motion_s")
        if code != 0:
            record["reason"] = report.get("message") or said
            return record
        if options.plan_only:
            return record
        code, report, said = report_of(
            options.tether, ["run", turned, "--plan", plan, "--seed", str(options.seed)], folder
        )
        record["reached"] = code == 0
        record["sim_time_s"], record["retries"] = report.get("sim_time_s"), report.get("retries")
        if code != 0:
            record["reason"] = report.get("reason") or said
    return record


def line_of(record):
    if not record["planned"]:
        return "not planned: " + record["reason"]
    if record["reached"]:
        return f"reached in {record['sim_time_s']:.1f} s, {record['retries']} retries"
    return "planned" + (": " + record["reason"] if "reason" in record else "")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", action="append", type=pathlib.Path)
    parser.add_argument("--angles", type=int, default=24)
    parser.add_argument("--only", action="append", type=int, help="only this angle, degrees")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--plan-only", action="store_true")
    parser.add_argument("--tether", default="build/release/bin/tether")
    parser.add_argument("--json")
    options = parser.parse_args()
    records = []
    failed = 0
    for scenario in options.scenario or [pathlib.Path(name) for name in DEFAULT]:
        mine = []
        for degrees in options.only or [360 * i // options.angles for i in range(options.angles)]:
            mine.append(measure(options, scenario, degrees))
            print(f"{scenario.stem} at {degrees} degrees: {line_of(mine[-1])}", flush=True)
        planned, reached = (sum(r[key] for r in mine) for key in ("planned", "reached"))
        print(f"{scenario.stem}: {planned} of {len(mine)} planned", end="")
        print("" if options.plan_only else f", {reached} of these reach the goal")
        failed += 0 if options.plan_only else planned - reached
        records += mine
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(records, indent=1) + "\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
