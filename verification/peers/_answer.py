"""Shared by the scripts of all peers: a scene as JSON on standard input, the result as JSON on standard output.

Times are processor times of this process and its children, so a busy machine does not lengthen them much.  Imports and
one uncounted run of the first setting, with all compilation, are not in them.  A run of more than LONG is not repeated:
the spread of its time is small beside it.
"""

import json
import resource
import sys
from importlib.metadata import version

LONG = 1.0
"""Seconds."""


def seconds():
    """Processor time so far, s."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def answer(package, solvers, version_of=version):
    """Answer the scene's questions.

    ``solvers`` has a function for every question, of the scene and one setting: it returns numbers and lists to be
    written, or raises where there is no solution.
    """
    scene = json.load(sys.stdin)
    runs = []
    for question, settings in scene["questions"].items():
        for first, setting in enumerate(settings):
            run = {"question": question, "setting": setting, "seconds": []}
            runs.append(run)
            try:
                if not first:
                    solvers[question](scene, **setting)
                for _ in range(scene["repeats"]):
                    began = seconds()
                    run |= solvers[question](scene, **setting)
                    run["seconds"].append(seconds() - began)
                    if run["seconds"][-1] > LONG:
                        break
            except (ArithmeticError, RuntimeError, ValueError) as error:
                run["failed"] = f"{type(error).__name__}: {error}"
            print(question, setting, run["seconds"], run.get("failed", ""), file=sys.stderr)
    json.dump({"version": version_of(package), "runs": runs}, sys.stdout)
