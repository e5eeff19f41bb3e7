"""Words of the command line that become materials, laws and protocols."""

from __future__ import annotations

from typing import Any

from bem._support.wording import shown

MATERIAL_HELP = (
    "elastic, sls:K (standard linear solid of modulus ratio K = E0/Einf), or prony:C1@T1,C2@T2,... (retardation "
    "strengths as fractions of the relaxed compliance, at retardation times)."
)


def parse_material(text: str) -> Any:
    """The material a word describes; see `MATERIAL_HELP`."""
    from bem.materials import Elastic, PronySeries, StandardLinearSolid

    kind, _, details = text.partition(":")
    try:
        if kind == "elastic" and not details:
            return Elastic()
        if kind == "sls":
            return StandardLinearSolid(float(details))
        if kind == "prony":
            terms = [term.split("@") for term in details.split(",")]
            return PronySeries([float(c) for c, _ in terms], [float(t) for _, t in terms])
    except ValueError as error:
        if "received" in str(error):
            raise
    raise ValueError(f"material must be {MATERIAL_HELP.rstrip('.')}; received {shown(text)}")


def one_of_cycle_and_forces(cycle: dict[str, Any], times: str | None, forces: str | None) -> bool:
    """Whether a force is prescribed and not a cycle.

    Raises:
        ValueError: both are given, or a part of either is missing.
    """
    given = [name for name, value in cycle.items() if value is not None]
    if (times is None) != (forces is None):
        raise ValueError(
            f"times and forces must be given together; received {'times' if forces is None else 'forces'} alone"
        )
    if forces is not None and given:
        raise ValueError(
            f"either a cycle or times and forces must be given; received both, {', '.join(given)} and forces"
        )
    missing = [name for name in cycle if name not in given]
    if forces is None and missing:
        raise ValueError(f"{', '.join(missing)} must be given, or times and forces; received neither")
    return forces is not None


def parse_numbers(name: str, text: str | None) -> list[float]:
    """Numbers separated by commas."""
    try:
        return [float(number) for number in (text or "").split(",")]
    except ValueError as error:
        raise ValueError(f"{name} must be numbers separated by commas; received {shown(text)}") from error


def parse_adhesion(text: str) -> Any:
    """The adhesion a word names."""
    from bem.tractions import LAWS

    if text not in LAWS:
        raise ValueError(f"adhesion must be one of {', '.join(LAWS)}; received {shown(text)}")
    return LAWS[text]()
