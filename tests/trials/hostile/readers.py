"""Are the numbers of a result finite? FITS images, tables and JSON are read here; `info` counts those of visibilities and gains."""

import array
import json
import math
import re
import sys

WORD = re.compile(r"(?<![\w.-])[-+]?(nan|inf|infinity)(?![\w.-])", re.IGNORECASE)


def strict(text):
    """JSON without NaN and Infinity."""
    def refuse(word):
        raise ValueError(f"holds {word}")
    return json.loads(text, parse_constant=refuse)


def fits(path):
    """The first fault of a FITS file of images: the numbers of every HDU are read."""
    data, at = path.read_bytes(), 0
    if len(data) % 2880 or not data:
        return f"has {len(data)} bytes, no multiple of 2880"
    while at < len(data):
        cards = {}
        while True:
            block = data[at:at + 2880].decode("ascii", "replace")
            at += 2880
            lines = [block[k:k + 80] for k in range(0, len(block), 80)]
            cards.update((c[:8].strip(), c[10:].split("/")[0].strip()) for c in lines if c[8:10] == "= ")
            if any(c.startswith("END ") for c in lines) or at >= len(data):
                break
        bad = [f"{key} = {value}" for key, value in cards.items() if WORD.fullmatch(value)]
        if bad:
            return f"the header has {bad[0]}"
        bits, axes = int(cards["BITPIX"]), int(cards.get("NAXIS", 0))
        count = math.prod(int(cards[f"NAXIS{k + 1}"]) for k in range(axes)) if axes else 0
        size = count * abs(bits) // 8
        if at + size > len(data):
            return "is cut off"
        if bits in (-32, -64):
            values = array.array("f" if bits == -32 else "d", data[at:at + size])
            if sys.byteorder == "little":
                values.byteswap()
            bad = sum(1 for v in values if not math.isfinite(v))
            if bad:
                return f"{bad} of {count} pixels are not finite"
        at += -(-size // 2880) * 2880
    return None


def described(path, info):
    """A file of visibilities or gains: `info` reads it and finds all unflagged numbers finite."""
    done = info(path)
    if done.code:
        return f"info: {done.err.strip()[:200]}"
    facts = strict(done.out)
    if facts.get("n_not_finite"):
        return f"{facts['n_not_finite']} visibilities are not finite"
    numbers = ("mean_amplitude", "rms_phase_rad", "integration_s", "shortest_baseline_m", "longest_baseline_m")
    lost = [key for key in numbers if key in facts and facts[key] is None]
    lost += [key for key in ("freq_hz", "channel_width_hz", "time_jd") if None in (facts.get(key) or [])]
    return f"{lost[0]} is not finite" if lost else None


def text(path):
    """Tables of studies may hold NaN, as the book says: a spread over one seed, a calibration that failed."""
    found = [m.group() for m in WORD.finditer(path.read_text(errors="replace"))]
    found = [word for word in found if word != "NaN" or path.name not in ("summary.csv", "trials.csv")]
    return f"holds {found[0]}" if found else None


def fault(path, info):
    """What is wrong with a result, or None."""
    try:
        if path.suffix == ".fits":
            return fits(path)
        if path.suffix in (".uvh5", ".calh5", ".uvfits"):
            return described(path, info)
        if path.suffix == ".json":
            strict(path.read_text())
        if path.suffix in (".csv", ".toml", ".cfg"):
            return text(path)
    except (ValueError, KeyError) as error:
        return str(error)
    return None
