#!/usr/bin/env python3
"""How well `ground_forces` knows what pushes CENTAURO, against PyBullet's contact forces.

Run with `./run exec python benchmark/forces.py [COURSE...] [--seed N] [--noise K] [--count N] [--json] [--world FILE]
[--engine NAME]`. Courses: `stand`, `drive` (0.5 m/s), `arms` (at their speed limits), `lifts` (of wheels, `--count`)
and `push` (100 N at the pelvis, `--count` directions). Plugins, with their shipped configurations, and PyBullet run in
memory; sensors err as in `config/robots/centauro/robot.yaml`, times K, 2 ms late. Progress is on stderr. A line has

- `wheel_rms`: error of the worst wheel's normal force, `sum_rms`: of their sum, by the weight [%]; truth is the mean
  of the last 5 ms;
- `contact_right`: cycles and wheels whose contact state is right [%], later than 20 ms after a change; truth is more
  than 5 N for 5 ms; `changes`, `wrong`: their counts;
- `push_20ms`: estimated share of a push along it after 20 ms, mean and least of all directions; `push_error`: length
  of the mean error from 60 ms on, mean and worst [%];
- `cycle`: median time of kinematics, dynamics and component by that of `pinocchio.computeAllTerms`, which take turns.

The exit code is 1 if a goal is missed: 2 % and 1 % standing, else 5 % and 3 %, 99.9 %, and for the mean of all pushes
50 % and 10 %.
"""

import argparse
import json
import sys

from estimation_cases.forces import COURSES, missed, run
from form import add_engine


def main() -> int:
    """Print all figures, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("course", nargs="*", help=f"of {', '.join(COURSES)}; default: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--noise", type=float, default=1.0, help="factor of all errors")
    parser.add_argument("--count", type=int, default=20, help="lifts and pushes")
    parser.add_argument("--world", help="file of the world; default: a plane")
    parser.add_argument("--json", action="store_true", help="an object for each line")
    add_engine(parser)
    given = parser.parse_args()
    if unknown := set(given.course) - set(COURSES):
        parser.error(f"no course {', '.join(sorted(unknown))}; expected some of {', '.join(COURSES)}")
    failed = False
    for course in given.course or COURSES:
        made = run(course, given.seed, given.noise, given.count, given.world)
        goals = missed(course, made)
        line = {"course": course, "seed": given.seed, "noise": given.noise, **made, "missed": goals}
        print(
            json.dumps(line) if given.json else "  ".join(f"{key} {value}" for key, value in line.items()), flush=True
        )
        failed = failed or bool(goals)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
