"""Which columns the text files of instruments have: their names, what they hold, and their units.

Quantities: time; force, compression positive; tension, a force positive in tension; deflection of the cantilever, in m
or V, compression positive; indentation, already without deflection; displacement of the stage, positive towards the
sample; height, positive away from it; z, a displacement whose direction the forces tell; separation of tip and sample;
contact_radius. A unit that a title or a line of units names replaces the one here.
"""

import re

_LONGEST_TITLE = 200  # the time of a search grows with the square of it
_TITLE = re.compile(r"\s*([^()\[\]/]*?)\s*(?:\(([^)]*)\)|\[([^\]]*)\]|/\s*(\S+))?\s*")

EXPORTERS: dict[str, dict[str, tuple[str, str]]] = {
    "Optics11 Piuma, Chiaro": {
        "time": ("time", "s"),
        "load": ("force", "uN"),
        "indentation": ("indentation", "nm"),
        "cantilever": ("deflection", "nm"),
        "piezo": ("displacement", "nm"),
    },
    "JPK text": {
        "seriestime": ("time", "s"),
        "series_time": ("time", "s"),
        "vdeflection": ("force", "N"),
        "vertical_deflection": ("force", "N"),
        "height": ("height", "m"),
        "measuredheight": ("height", "m"),
        "smoothedmeasuredheight": ("height", "m"),
        "capacitivesensorheight": ("height", "m"),
        "tipsampleseparation": ("separation", "m"),
        "vertical_tip_position": ("separation", "m"),
    },
    "Bruker ASCII": {
        "time": ("time", "s"),
        "calc_ramp": ("z", "nm"),
        "height_sensor": ("z", "nm"),
        "sep": ("separation", "nm"),
        "defl": ("deflection", "nm"),
        "force": ("force", "pN"),
    },
    "AtomicJ": {
        "z": ("z", "um"),
        "deflection": ("deflection", "um"),
        "indentation": ("indentation", "um"),
        "force": ("force", "nN"),
    },
    "generic": {
        **dict.fromkeys(("time", "t"), ("time", "")),
        **dict.fromkeys(("force", "load"), ("force", "")),
        "tension": ("tension", ""),
        "deflection": ("deflection", ""),
        **dict.fromkeys(("indentation", "depth"), ("indentation", "")),
        **dict.fromkeys(("displacement", "position", "stage", "piezo"), ("displacement", "")),
        "height": ("height", ""),
        "z": ("z", ""),
        "separation": ("separation", ""),
        "contact_radius": ("contact_radius", ""),
    },
}
"""Name of a column, in lower case with underscores, to quantity and unit; a unit of "" must be in the title."""

FACTS = {
    "stiffness": ("k (N/m)", "k", "springConstant", "spring constant", "Spring Constant (N/m)"),
    "sensitivity": ("sensitivity", "Deflection Sensitivity (nm/V)"),
}
"""Lines before the table that name the spring constant in N/m and the sensitivity in m/V."""

PARTS = {"approach": ("ex", "approach", "extend", "trace"), "retraction": ("rt", "retract", "withdraw", "retrace")}
"""Words in the titles of paired columns, of which the approach and the retraction each have their own."""


def column_of(title: str) -> tuple[str, str, str]:
    """Name of a column, in lower case with underscores, its unit, and the part of a pair that it belongs to."""
    match = _TITLE.fullmatch(title.strip().strip('"')) if len(title) <= _LONGEST_TITLE else None
    if match is None:
        return "", "", ""
    name, unit = match[1].lower(), next((group.strip() for group in match.groups()[1:] if group), "")
    name, segment = re.sub(r"[\s_\-.]+", "_", name).strip("_"), ""
    for which, words in PARTS.items():
        for word in words:
            if re.search(rf"(?:^|_){word}(?:_|$)", name):
                name, segment = re.sub(rf"(?:^|_){word}(?=_|$)", "", name).strip("_"), which
    if not any(name in table for table in EXPORTERS.values()) and not unit:
        # The unit is the last piece of the title, or the last before a word such as Ex.
        pieces = [
            piece for piece in re.split(r"[\s_]+", match[1].strip()) if piece.lower() not in sum(PARTS.values(), ())
        ]
        name, unit = "_".join(pieces[:-1]).lower(), pieces[-1] if pieces else ""
    return name, unit, segment
