"""The solver of one git revision as a program that runs one simulation per line of input, for `solver_processes`.

It runs in a process whose path begins with that revision's `bem`, so that it may use only what the public interface has
in all of them. Each line of input is a JSON object: `tabor`, `modulus_ratio`, the
arguments of `LoadingProtocol` as `protocol`, `accuracy`, and instants `times`. Each line of output is one too: seconds
of this process, `status`, the statistics that this revision has, and, where completed, the results.
"""

import json
import sys
import time

import bem


def answer(asked: dict) -> dict:
    """Simulate once; what the solver raises becomes the status."""
    started = time.process_time()
    try:
        scene = bem.Scene(asked["tabor"], bem.StandardLinearSolid(asked["modulus_ratio"]))
        protocol = bem.LoadingProtocol(**asked["protocol"])
        started = time.process_time()
        trajectory = bem.simulate(scene, protocol, asked["accuracy"])
        seconds = time.process_time() - started
    except Exception as error:  # one broken case must not end the comparison
        return {"seconds": time.process_time() - started, "status": f"{type(error).__name__}: {error}", "work": {}}
    found = {
        "seconds": seconds,
        "status": trajectory.status,
        "work": {name: value for name, value in vars(trajectory.stats).items() if isinstance(value, int | float)},
    }
    if trajectory.completed:
        found["results"] = [trajectory.pull_off_force, trajectory.hysteresis]
        found["results"] += trajectory.at([min(instant, trajectory.time[-1]) for instant in asked["times"]]).tolist()
    return found


if __name__ == "__main__":
    answers, sys.stdout = sys.stdout, sys.stderr  # so that nothing the solver prints is taken for an answer
    print(bem.__file__, file=answers, flush=True)
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), file=answers, flush=True)
