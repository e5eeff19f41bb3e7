"""Campaigns of any scenes and protocols, and their file of whole trajectories.

Where a data set holds protocols of three phases at fixed measurement steps, this file holds for every case the scene,
the indentation history and what `bem.simulate` returned. docs/cluster.md describes its groups. Units as in
`bem.trajectory`.
"""

import functools
import hashlib
import json
from collections.abc import Iterable
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bem._support.outputs import write_whole
from bem._support.validation import FloatArray
from bem._support.wording import shortened, shown
from bem.accuracy import resolve_accuracy
from bem.dataset.campaign.case_records import ARRAYS, CaseRecord, case_columns, records_of
from bem.dataset.campaign.descriptions import described, restored
from bem.dataset.campaign.work import Solver, expected_seconds, solver_name
from bem.dataset.file import plain_attribute, read_tree, write_tree
from bem.dataset.opening import SEALED, DamagedFileError, open_dataset
from bem.dataset.records import COMPLETED, FAILED, RESULTS, Columns
from bem.dataset.sealed_file import BLOCK, seal
from bem.protocol import ForceProtocol, Protocol, history_of
from bem.scene import Scene
from bem.trajectory import Trajectory

FORMAT = "viscoelastic-contact-cases"
FORMAT_VERSION = 1


class Case(NamedTuple):
    """A case of a campaign with its result.

    Args:
        scene, protocol: what was simulated.
        trajectory: what `bem.simulate` returned; `None` where it raised an error.
        reason: why there is no completed trajectory, empty where there is one.
    """

    scene: Scene
    protocol: Protocol
    trajectory: Trajectory | None
    reason: str


class Cases:
    """Scenes and protocols to simulate: any material, any adhesion, any indentation history.

    Args:
        cases: pairs of a `Scene` and a protocol of any kind, at least one.
        accuracy: as in `bem.simulate`, the same for all.

    Raises:
        ValueError: naming the quantity, what is allowed and what was received.

    Examples:
        >>> from bem import Cases, Elastic, LoadingProtocol, Scene
        >>> protocol = LoadingProtocol(peak_indentation=2.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
        >>> len(Cases([(Scene(tabor=mu, material=Elastic()), protocol) for mu in (0.5, 1.0)]))
        2
    """

    def __init__(self, cases: Iterable[tuple[Scene, Protocol]], accuracy: str | float = "standard") -> None:
        resolve_accuracy(accuracy)
        self.accuracy = accuracy
        self.cases = [_checked(number, case) for number, case in enumerate(cases)]
        if not self.cases:
            raise ValueError("cases must hold at least one pair of a scene and a protocol; received none")
        self.indices = np.arange(len(self.cases))
        self._texts = [
            (json.dumps(described(scene)), json.dumps(described(protocol))) for scene, protocol in self.cases
        ]

    def __len__(self) -> int:
        return len(self.cases)

    def identity(self, solver: Solver | None = None) -> dict[str, Any]:
        """Everything that determines the numbers."""
        digest = hashlib.sha256(json.dumps(self._texts).encode()).hexdigest()
        plain = {"cases": digest, "count": len(self), "accuracy": self.accuracy}
        return plain | {"solver": solver_name(solver)}

    def shard_path(self, out: Path) -> Path:
        """Where the file goes; there are no shards, since a share of the cases is itself a list of cases."""
        return out

    def expected_seconds(self, indices: np.ndarray) -> FloatArray:
        """Seconds that some of the cases may take, shape (n,); a history takes as long as its segments together."""
        chosen = [self.cases[index] for index in indices]
        paths = [_depths(scene, protocol) for scene, protocol in chosen]
        travel = [np.sum(np.maximum(path[1:], path[:-1]).clip(0.0)) for path in paths]
        tabor = np.array([scene.tabor for scene, _ in chosen])
        return expected_seconds({"tabor": tabor, "peak_indentation": np.array(travel) / 3.0}, self.accuracy)

    def items(self, indices: np.ndarray) -> list[tuple[Scene, Protocol]]:
        """What a worker needs to know of some of the cases."""
        return [self.cases[index] for index in indices]

    @property
    def simulator(self) -> functools.partial:
        """The function by which a worker turns an index, an item and a solver into a record."""
        return functools.partial(_simulated, self.accuracy)

    def failed(self, index: int, reason: str) -> CaseRecord:
        """The record of a case without a result."""
        return CaseRecord(index, FAILED, reason)

    def columns(self, records: Iterable[CaseRecord]) -> Columns:
        """Arrays of some records, in the order of their index."""
        return case_columns(records)

    def records(self, columns: Columns) -> list[CaseRecord]:
        """The records that such arrays hold."""
        return records_of(columns)

    def read(self, path: Path) -> tuple[Columns, dict[str, Any]]:
        """Arrays and root attributes of a complete file.

        Raises:
            DamagedFileError, ValueError: as `load_cases`.
        """
        return _read(path)[:2]

    def write(self, path: Path, columns: Columns, attributes: dict[str, Any], scratch: Path | None) -> None:
        """Write the file; `scratch` is the folder of its temporary file.

        Raises:
            OSError: nothing was written.
        """
        for name, texts in zip(("scene", "protocol"), zip(*self._texts, strict=True), strict=True):
            columns = columns | {name: np.array([texts[index] for index in columns["index"]], dtype=object)}
        kind = {"format": FORMAT, "format_version": FORMAT_VERSION, SEALED: 1, "accuracy": self.accuracy}
        memory = BytesIO()
        write_tree(memory, columns, kind | attributes, first_block=BLOCK)
        seal(memory)
        write_whole(path, memory.getbuffer(), scratch)


def load_cases(path: str | Path) -> list[Case]:
    """Read the file that `bem.run_campaign` wrote of `bem.Cases`.

    Returns:
        the cases in their order, each with its scene, its protocol and the trajectory that `bem.simulate` returned.

    Raises:
        FileNotFoundError: no such file.
        DamagedFileError: a `ValueError`; the file is damaged, or its parts are inconsistent.
        ValueError: not such a file, or of another version of the format.
    """
    return _read(Path(path))[2]


def _read(path: Path) -> tuple[Columns, dict[str, Any], list[Case]]:
    with open_dataset(path, FORMAT, FORMAT_VERSION) as file:
        try:
            columns = read_tree(file)
            attributes = {name: plain_attribute(value) for name, value in file.attrs.items()}
            rows = zip(columns["scene"], columns["protocol"], records_of(columns), strict=True)
            cases = [
                Case(restored(json.loads(scene)), restored(json.loads(protocol)), record.trajectory, record.reason)
                for scene, protocol, record in rows
            ]
            for name in ("wall_seconds", "core_seconds"):
                attributes[name] = float(attributes[name])
            dict(attributes["campaign"])
        except Exception as error:  # on a damaged file the library may raise any error
            raise DamagedFileError(
                f"expected a complete file of cases; received {str(path)!r}, which cannot be read "
                f"({shortened(str(error)) or type(error).__name__})"
            ) from error
    return columns, attributes, cases


def _checked(number: int, case: Any) -> tuple[Scene, Protocol]:
    try:
        scene, protocol = case
        sound = isinstance(scene, Scene) and isinstance(protocol, Protocol)
    except (TypeError, ValueError):
        sound = False
    if not sound:
        raise ValueError(f"case {number} must be a Scene and a protocol; received {shown(case)}")
    try:
        _depths(scene, protocol)
    except ValueError as error:
        raise ValueError(f"case {number}: {error}") from error
    return scene, protocol


def _depths(scene: Scene, protocol: Protocol) -> FloatArray:
    """Indentation at the corners of a protocol; of a prescribed force that of Hertz."""
    if isinstance(protocol, ForceProtocol):
        return scene.tabor * (0.75 * np.pi * np.maximum(-protocol.forces, 0.0)) ** (2.0 / 3.0)
    return history_of(protocol, scene.tabor).indentations


def _simulated(accuracy: str | float, index: int, case: tuple[Scene, Protocol], solver: Solver) -> CaseRecord:
    # One failing case must not end the batch, whatever error it raises.
    try:
        trajectory = solver(*case, accuracy=accuracy)
        finite = all(np.all(np.isfinite(getattr(trajectory, name))) for name in ARRAYS)
        scalars = tuple(float(getattr(trajectory, name)) for name in RESULTS)
    except Exception as error:
        return CaseRecord(index, FAILED, f"{type(error).__name__}: {error}")
    if not finite:
        return CaseRecord(index, FAILED, "the solver returned numbers that are not finite")
    # A copy drops what the trajectory has computed and kept since.
    status, reason = (COMPLETED, "") if trajectory.completed else (FAILED, trajectory.status)
    return CaseRecord(index, status, reason, replace(trajectory), scalars)
