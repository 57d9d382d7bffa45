"""Numeric options with values that are no numbers, no size that can be computed, or without their unit.

The options are those that `--help` lists, and the keys are those of the schemas of `run` and `study`: a new option has its turn without a line here.
What is known here is only how its value is written, by the word that help prints for it. Must be refused: NaN, infinity, 1e300, nothing, digits of another
script, and a quantity without its unit or with that of another quantity. Every other call may do as it likes, as long as all that it writes is finite.
"""

import random
import re

from .values import CHAIN, COMPANIONS, PATTERNS, QUANTITIES, OTHERS, TABLES, TYPES, LINES, BY_NAME, REFUSED
from . import readers

HOSTILE = ["nan", "NaN", "inf", "-inf", "1e300", "-1e300", "1e-300", "0", "-0", "-1", "1e9", "18446744073709551616", "", "１２", "٣"]
RIGHT = ["1", "2", "3", "0.5", "0.1", "16", "32", "100", "300"]
# A flat prior may be given in either unit, and is converted.
BRIGHTNESS = set(QUANTITIES["TEMP"] + QUANTITIES["FLUX"])
OPTION = re.compile(r"^ +(?:-\w, )?--([a-z0-9-]+) <([^>]+)>", re.MULTILINE)


def number(rng, hostile):
    return rng.choice(HOSTILE if hostile else RIGHT)


def value(rng, patterns):
    """A value of an option: (text, what must be refused in it or None)."""
    pattern = rng.choice(patterns)
    if isinstance(pattern, tuple):
        pattern, units = "@" + pattern[0], pattern
        draw = rng.random()
        if draw < 0.06:
            return number(rng, False), "no unit"
        if draw < 0.12:
            other = rng.choice([u for q in QUANTITIES.values() for u in q if u not in ("s", "m", "d", "h", "min")])
            same = next((q for q in QUANTITIES.values() if units[0] in q), units)
            return number(rng, False) + other, None if other in same or {units[0], other} <= BRIGHTNESS else "another unit"
    holes = pattern.count("@")
    wrong = rng.randrange(holes)
    drawn = [number(rng, k == wrong and rng.random() < 0.9) for k in range(holes)]
    for n in drawn:
        pattern = pattern.replace("@", n, 1)
    return pattern, next((n or "nothing" for n in drawn if n in REFUSED), None)


def with_option(words, name, text):
    """The words of a line with one option set, in place of its value there."""
    words = list(words)
    flag = f"--{name}"
    if flag in words:
        k = words.index(flag)
        del words[k:k + 2]
    return words + [f"{flag}={text}"]


def with_companion(words, name, line):
    sub = next(w for w in line.split() if w not in ("scene", "layout"))
    more = COMPANIONS.get((sub, name), COMPANIONS.get(name, "")).split()
    there = {w.split("=")[0] for w in words}
    return words if more and more[0].split("=")[0] in there else words + more


class Options:
    """All numeric options of a program: (line, option, patterns)."""

    def __init__(self, bench):
        self.all = []
        for line in LINES:
            words = line.split()
            sub = words[:2] if words[0] in ("scene", "layout") else words[:1]
            said = bench.call([*sub, "-h"]).out
            for name, meta in OPTION.findall(said):
                patterns = BY_NAME.get((sub[-1], name), BY_NAME.get(name, PATTERNS.get(meta)))
                if patterns:
                    self.all.append((line, name, patterns))

    def draw(self, rng):
        line, name, patterns = rng.choice(self.all)
        text, must = value(rng, patterns)
        words = with_companion(with_option(line.split(), name, text), name, line)
        if rng.random() < 0.2:
            # A second option of the same line, so that values meet.
            _, second, others = rng.choice([o for o in self.all if o[0] == line and o[1] != name])
            more, must_too = value(rng, others)
            words, must = with_companion(with_option(words, second, more), second, line), must or must_too
        return words, must, (words[0], name)


def resolved(schema, entry):
    """The type of a key: a name of `$defs`, `number`, `integer`, `values`, or None for what is no number."""
    for one in entry.get("anyOf", [entry]):
        if "$ref" in one:
            return one["$ref"].rsplit("/", 1)[1]
        kinds = one.get("type")
        kinds = [kinds] if isinstance(kinds, str) else kinds or []
        if kinds == ["array"]:
            return resolved(schema, one["items"]) if isinstance(one.get("items"), dict) else "number"
        for kind in ("number", "integer"):
            if kind in kinds:
                return kind
        if kinds == [] and "oneOf" not in one:
            return "number"
    return None


def section_keys(schema, entry):
    """The numeric keys of a section, with how a value is written."""
    for one in [entry, *entry.get("anyOf", [])]:
        one = one.get("items", one)
        if "$ref" in one:
            one = schema["$defs"][one["$ref"].rsplit("/", 1)[1]]
        if "properties" in one:
            return [(key, TYPES[kind], p.get("type") == "array") for key, p in one["properties"].items() if (kind := resolved(schema, p)) in TYPES]
    return []


class Keys:
    """All numeric keys of the configurations of `run` and `study`, and of the errors of `corrupt`: (command, section, key, patterns, list)."""

    def __init__(self, bench):
        self.all = []
        for command in ("run", "study"):
            schema = readers.strict(bench.call([command, "--schema"]).out)
            for section, entry in schema["properties"].items():
                self.all += [(command, section, *key) for key in section_keys(schema, entry)]
            self.all += [(command, "", key, TYPES["integer"], False) for key in ("seed", "seeds") if key in schema["properties"]]
            if command == "study":
                self.all += [(command, "points", *key) for key in section_keys(schema, {"$ref": "#/$defs/ScenePoint"})]
            else:
                self.all += [("corrupt", "error", *key) for key in section_keys(schema, {"$ref": "#/$defs/ErrorOptions"}) if key[0] != "seed"]

    def draw(self, rng, bench):
        command, section, key, patterns, listed = rng.choice(self.all)
        text, must = value(rng, patterns)
        quoted = not all(p == "@" for p in patterns) or rng.random() < 0.1
        if patterns == ["@"] and quoted:
            must = must or "a number in quotes"
        written = f'"{text}"' if quoted else text or '""'
        bench.write("in.toml", config(command, section, key, f"[{written}]" if listed else written))
        words = {"run": "run in.toml -o out/o", "study": "study in.toml -o out/o", "corrupt": "corrupt v.uvh5 --config in.toml -o out/o.uvh5"}[command].split()
        return words, must, (command, section, key)


def config(command, section, key, text):
    """A configuration in which one key of one section is set."""
    tables = {name: dict(keys) for name, keys in TABLES[command].items()}
    table = tables.setdefault(section, dict(OTHERS.get(section, {})))
    for name, other in CHAIN.get((section, key), CHAIN.get(key, {})).items():
        table[name] = other
    table[key] = text
    doubled = {("run", "clean"), ("study", "axis"), ("corrupt", "error")}
    lines = [f"{k} = {v}" for k, v in tables.pop("", {}).items()]
    if "points" in tables:
        # Points stand in place of the file of the scene.
        tables["scene"] = {"points": "[{ " + ", ".join(f"{k} = {v}" for k, v in tables.pop("points").items()) + " }]"}
    for name, keys in tables.items():
        head = f"[[{name}]]" if (command, name) in doubled else f"[{name}]"
        lines += [head, *(f"{k} = {v}" for k, v in keys.items())]
    return "\n".join(lines) + "\n"


def judge(bench, done, must, key):
    """Look at what a call did and left."""
    faults = done.faults()
    told = ""
    if "in.toml" in done.line:
        told = "  with in.toml: " + (bench.folder / "in.toml").read_text().replace("\n", "; ")
    if done.code == 0 and done.ended:
        if must:
            faults.append(("taken", f"took {must}"))
        faults += bench.check_results()
        found = readers.WORD.search(done.out)
        if found and "--help" not in done.line:
            faults.append(("result", f"printed {found.group()}"))
    if bench.left() and done.ended:
        faults.append(("leftover", f"left {bench.left()}"))
    if done.code == 2 and list(bench.out.iterdir()):
        faults.append(("leftover", f"refused, and made {sorted(p.name for p in bench.out.iterdir())}"))
    bench.counts["refused" if done.code else "done"] += 1
    for kind, text in faults:
        bench.fail(kind, done.line + told, text, (*key, must if kind == "taken" else ""))


def campaign(bench, count, seed):
    for line in LINES:
        bench.must_work(line.split())
    options, keys = Options(bench), Keys(bench)
    print(f"numbers: {len(options.all)} options and {len(keys.all)} keys", flush=True)
    for case in bench.cases(count):
        rng = random.Random(f"numbers {seed} {case}")
        words, must, key = keys.draw(rng, bench) if rng.random() < 0.12 else options.draw(rng)
        if rng.random() < 0.5:
            words = ["--json", *words]
        if not any(w.startswith("--threads") for w in words):
            words = ["--threads", "1", *words]
        done = bench.call(words)
        judge(bench, done, must, key)
        (bench.folder / "in.toml").unlink(missing_ok=True)
        bench.clear()
        odd = bench.restore() if case % 20 == 19 else []
        if odd:
            bench.fail("input", done.line, f"this call or one of the 19 before it changed or made {odd}")
