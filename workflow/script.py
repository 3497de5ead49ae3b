"""The workflow's only script: call one function and store what it returns.

A rule's ``params`` name the function, ``call="module:function"``, the ``title`` of its dataset, and its arguments.
Inputs with a name, except ``code``, are arguments too: a netCDF file as the dataset in it, a list of them as a list,
everything else as a path.  A function may also take ``progress``, called with a line for
the rule's log, ``threads``, and ``output``, the rule's outputs, which it then writes itself.
"""

import os
import signal
import sys

# One core per process: Snakemake tells the numerical libraries to use all of the rule's threads, which on systems as
# small as these wait for each other, and count double in the processor time. Before anything imports them.
os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
# OpenCV's threads do not survive the fork of a pool's processes: these waited for them for ever.
os.environ["OPENCV_FOR_THREADS_NUM"] = "1"
# Processes that a study starts find the tasks and the studies, too.
WORKFLOW = os.path.dirname(os.path.abspath(__file__))
PLACES = [WORKFLOW, os.path.dirname(WORKFLOW)]
sys.path[:0] = PLACES
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (*PLACES, os.environ.get("PYTHONPATH"))))


def terminated(number, _):
    sys.exit(128 + number)


def main(snakemake):
    from importlib import import_module
    from inspect import signature
    from time import perf_counter

    from stripfold.base.errors import StripfoldError
    from stripfold.files import store

    # The commit of the code that runs: on a long job the checkout may have moved on before its result is stored.
    store.running_commit()
    given = dict(snakemake.params.items())
    call, title, _ = given.pop("call"), given.pop("title", ""), given.pop("digest", "")
    with open(snakemake.log[0], "w", encoding="utf-8") as log:

        def progress(line):
            print(line, file=log, flush=True)

        try:
            module, _, name = call.partition(":")
            function = getattr(import_module(module), name)
            extra = {"progress": progress, "threads": snakemake.threads, "output": snakemake.output}
            given |= {key: _content(value) for key, value in snakemake.input.items() if key != "code"}
            given |= {key: value for key, value in extra.items() if key in signature(function).parameters}
            began = perf_counter()
            result = function(**given)
            seconds = round(perf_counter() - began, 1)
            if result is not None:
                paths = snakemake.output.get("data", snakemake.output)
                pairs = zip(result, paths, strict=True) if isinstance(result, list) else [(result, snakemake.output[0])]
                for data, path in pairs:
                    store.write(
                        data.assign_attrs({"seconds": seconds} | data.attrs),
                        path,
                        title=data.attrs.get("title") or title,
                        config=snakemake.config,
                    )
        except StripfoldError as error:
            progress(f"error: {error}")
            print(f"{snakemake.rule}: {error}", file=sys.stderr)
            sys.exit(error.exit_code)


def _content(value):
    from pathlib import Path

    from stripfold.files import store

    if not isinstance(value, str):
        return [_content(item) for item in value]
    return store.read(value) if value.endswith(".nc") else Path(value)


# As an exception, so that what is half written is removed.
signal.signal(signal.SIGTERM, terminated)
main(snakemake)
