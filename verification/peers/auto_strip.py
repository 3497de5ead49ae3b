"""AUTO-07p on the heavy elastica: along the branch of lambda to an equilibrium, and to the first limit point.

Run as its manual has it, compiled once against the library of Debian's package `auto-07p`; without its Python layer, so
no interpreter's start is in the times.
"""

import subprocess
import tempfile
from functools import cache
from pathlib import Path

from _answer import answer

EQUATIONS = Path(__file__).with_name("auto_strip.f90")
LIBRARY = Path("/usr/lib/auto-07p/lib")
# Its own defaults but for: output, the whole system in one block (no periodic solution), EPSL as in its demos.
CONSTANTS = """\
NDIM=5, IPS=4, IRS=0, ILP=1
ICP=[1,2,3,4]
NTST={intervals}, NCOL={degree}, IAD=3, ISP=0, ISW=1, IPLT=0, NBC=8, NINT=0
NMX=400, NPR=0, MXBF=0, IID=2, ITMX=8, ITNW=7, NWTN=3, JAC=0
EPSL=1e-8, EPSU=1e-8, EPSS=1e-6
DS=0.1, DSMIN=1e-4, DSMAX={largest_step}, IADS=1
NPAR=5
UZR={{1: [{lam!r}]}}
STOP=['{stop}']
"""
LIMIT_POINT, ASKED_FOR = 5, -4
"""AUTO's numbers for its kinds of points."""


@cache
def program():
    """The equations, compiled."""
    folder = tempfile.TemporaryDirectory()
    target = Path(folder.name) / "strip"
    objects = sorted(str(path) for path in LIBRARY.glob("*.o"))
    if not objects:
        raise RuntimeError(f"no object files in {LIBRARY}")
    subprocess.run(
        ["gfortran", "-O2", "-fopenmp", "-o", target, EQUATIONS, *objects],
        cwd=folder.name,
        check=True,
        capture_output=True,
    )
    return folder, target


def run(scene, stop, intervals, degree, largest_step):
    """One run; its `fort.7` and `fort.8`."""
    _, target = program()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        constants = CONSTANTS.format(
            intervals=intervals, degree=degree, largest_step=largest_step, lam=scene["lam"], stop=stop
        )
        (folder / "fort.2").write_text(constants)
        (folder / "fort.3").touch()
        rows = [scene["start"]["parameters"], *scene["start"]["rows"]]
        (folder / "start.dat").write_text("".join(" ".join(map(repr, row)) + "\n" for row in rows))
        done = subprocess.run([target], cwd=folder, capture_output=True, text=True, timeout=60, check=False)
        if done.returncode:
            raise RuntimeError(f"AUTO ended with code {done.returncode}: {done.stderr.strip()}")
        return (folder / "fort.7").read_text(), (folder / "fort.8").read_text()


def points(branch):
    """(kind, label, parameters) of the labelled points in the text of a `fort.7`."""
    found = []
    for line in branch.splitlines():
        fields = line.split()
        # Its head has a zero where points have the number of their branch.
        if fields and fields[0] != "0" and fields[3] != "0":
            found.append((int(fields[2]), int(fields[3]), [float(field) for field in fields[4:]]))
    return found


def solution(solutions, label):
    """The rows t, u_1, ... of one solution in the text of a `fort.8`."""
    lines = solutions.splitlines()
    at = 0
    while at < len(lines):
        head = [int(field) for field in lines[at].split()]
        # 3 label, 6 number of points, 8 lines of all that belongs to it; no more than seven numbers are on a line.
        if head[3] == label:
            return [[float(field) for field in line.split()] for line in lines[at + 1 : at + 1 + head[6]]]
        at += 1 + head[8]
    raise RuntimeError(f"no solution with the label {label}")


def first(branch, kind, what):
    """Label and parameters of the first point of a kind."""
    for of, label, values in points(branch):
        if of == kind:
            return label, values
    raise RuntimeError(f"no {what} was found")


def equilibrium(scene, **setting):
    branch, solutions = run(scene, "UZ1", **setting)
    label, values = first(branch, ASKED_FOR, f"point with lambda = {scene['lam']:g}")
    free = values[PARAMETERS["free length"]]
    rows = solution(solutions, label)
    return {
        "s": [free - row[5] for row in reversed(rows)],
        "place": [[free - row[1], row[2]] for row in reversed(rows)],
    }


def critical(scene, **setting):
    return {"lambda_c": first(run(scene, "LP1", **setting)[0], LIMIT_POINT, "limit point")[1][0]}


# In a line of `fort.7` the norm stands after lambda and before what the solution's parts reach; the other three
# parameters that were asked for come last.
PARAMETERS = {"free length": -3}


def installed(package):
    """The version of Debian's package."""
    asked = ["dpkg-query", "--show", "--showformat=${Version}", package]
    return subprocess.run(asked, capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    answer("auto-07p", {"equilibrium": equilibrium, "critical": critical}, installed)
