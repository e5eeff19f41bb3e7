"""Which columns the text files of instruments have: their names, what they hold, and their units.

Quantities: time; force, compression positive; tension, a force positive in tension; deflection of the cantilever, in m
or V, compression positive; indentation, already without deflection; displacement of the stage, positive towards the
sample; height, positive away from it; z, a displacement whose direction the forces tell; separation of tip and sample;
contact_radius. A unit that a title or a line of units names replaces the one here.
"""

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
