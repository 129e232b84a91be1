"""Hostile inputs: what nobody should be able to break a command with. Everything is drawn from the Random that is given."""
import random
import re
import struct
import subprocess

NUMBERS = ["0", "-0", "-1", "1e308", "1e-320", "1e999", "-1e999", "NaN", "inf", "9223372036854775807", "9223372036854775808",
           "-9223372036854775809", "18446744073709551616", "4294967295", "2147483648", "0x7fffffff", "1" * 400, "0." + "0" * 400 + "1",
           "1e", "--1", "1_000", "٣", "", "65535", "65536", "-32769", "1e-9", "99999999999 s", "1e300 s", "0 s", "-5 s", "9e18 ns", "0 Hz", "1e300 Hz"]
TEXTS = ["", " ", "\0", "a\0b", "\ufeff", "\u202e", "é" * 3, "💥", "../../../../etc/passwd", "/dev/zero", "/dev/stdin", "/proc/self/mem",
         "http://127.0.0.1:1/", "file:///etc/passwd", "a" * 5000, "%s%n%99999d", "${HOME}", "$(id)", "`id`", "'\"", "<", "&#0;", "&#x110000;", "]]>", "-->",
         "{{{{", "[[[[", "*", "**", ".", "..", "/", "\\", "\t", "\r\n", "null", "true", "~", "!!binary x", "&a *a", "__proto__", "constructor",
         "while(true);", "new Array(4e9).join()", "'a'.repeat(1e9)", "(function f(){f()})()", "/(a+)+$/.test('aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa!')"]
WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_.]*|\d+(?:\.\d+)?|\"[^\"\n]*\"|'[^'\n]*'|[<>{}\[\]():,;=&]")


def mutated(text, chance, others=()):
    """A text of the examples with one to four slips: words, lines, numbers, octets, encodings."""
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        text = chance.choice(SLIPS)(text, chance, others)
    return text


def _word(text, chance):
    found = list(WORD.finditer(text))
    return chance.choice(found) if found else None


def _another_value(text, chance, _):
    found = _word(text, chance)
    if not found:
        return text
    value = chance.choice(NUMBERS if found[0][0].isdigit() or chance.random() < 0.3 else TEXTS)
    if found[0][0] in "\"'":
        value = found[0][0] + value + found[0][0]
    return text[:found.start()] + value + text[found.end():]


def _another_number(text, chance, others):
    found = list(re.finditer(r"\d+(?:\.\d+)?", text))
    if not found:
        return _another_value(text, chance, others)
    at = chance.choice(found)
    return text[:at.start()] + chance.choice(NUMBERS) + text[at.end():]


def _swapped_words(text, chance, _):
    one, two = _word(text, chance), _word(text, chance)
    if not one or one.start() == two.start():
        return text
    if one.start() > two.start():
        one, two = two, one
    return text[:one.start()] + two[0] + text[one.end():two.start()] + one[0] + text[two.end():]


def _dropped_word(text, chance, _):
    found = _word(text, chance)
    return text[:found.start()] + text[found.end():] if found else text


def _lines(text, chance, others):
    lines = text.split("\n")
    at = chance.randrange(len(lines))
    what = chance.randrange(5)
    if what == 0:
        del lines[at]
    elif what == 1:
        lines[at:at] = [lines[at]] * chance.choice((1, 3, 400))
    elif what == 2:
        lines.insert(chance.randrange(len(lines)), lines.pop(at))
    elif what == 3:
        lines[at] = chance.choice(("  ", "\t", " " * 300)) + lines[at]
    elif others:
        other = chance.choice(others).split("\n")
        start = chance.randrange(len(other))
        lines[at:at] = other[start:start + chance.randrange(1, 12)]
    return "\n".join(lines)


def _truncated(text, chance, _):
    return text[:chance.randrange(len(text) + 1)]


def _repeated(text, chance, _):
    """A part many times over, or within itself."""
    start = chance.randrange(len(text) + 1)
    part = text[start:start + chance.randrange(1, 200)]
    return text[:start] + part * chance.choice((2, 50, 1000)) + text[start:]


def _octet(text, chance, _):
    at = chance.randrange(len(text) + 1)
    return text[:at] + chance.choice(("\0", "\x01", "\x1b[2J", "\x7f", "\udcff", "\ufffe", "\ufeff", "\u2028", "<", "&", "\"", "]", "}", "#")) + text[at:]


SLIPS = (_another_value, _another_value, _another_number, _another_number, _swapped_words, _dropped_word, _lines, _lines, _truncated, _repeated, _octet)


def encoded(text, chance):
    """As octets; now and then in an encoding that nobody expects."""
    plain = text.encode("utf-8", "surrogateescape" if all(not 0xD800 <= ord(c) < 0xDC80 for c in text) else "replace")
    what = chance.randrange(40)
    if what == 0:
        return b"\xef\xbb\xbf" + plain
    if what == 1:
        return text.encode("utf-16", "replace")
    if what == 2:
        return text.encode("utf-32-be", "replace")
    if what == 3:
        return text.encode("latin-1", "replace") + b"\xe9\xff"
    if what == 4:
        return plain.replace(b"\n", b"\r")
    return plain


# ---- what is wrong by intent, for each kind: (name, octets), refused by `check`

def nested(begin, end, n, middle=""):
    return begin * n + middle + end * n


def _tree(inside, more=""):
    return f'<root BTCPP_format="4" main_tree_to_execute="Main"><BehaviorTree ID="Main">{inside}</BehaviorTree>{more}</root>'


def _chart(inside, more=""):
    return f'<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"{more}>{inside}</scxml>'


NONSENSE_OF_ANY_TEXT = {
    "empty": b"", "nul": b"\0" * 4096, "noise": random.Random(1).randbytes(3000), "zip": b"PK\x03\x04" + bytes(300), "elf": b"\x7fELF" + bytes(300),
    "bom": b"\xef\xbb\xbf", "utf-16": "nonsense".encode("utf-16"), "long-line": b"x" * 300_000, "brackets": b"[" * 200_000, "braces": b"{" * 200_000,
    "quotes": b'"' * 200_000, "less": b"<" * 200_000, "new-lines": b"\n" * 300_000, "backslashes": b"\\" * 100_000,
}
NONSENSE = {
    "tree": {
        "deep": _tree(nested("<Inverter>", "</Inverter>", 200_000, "<AlwaysSuccess/>")),
        "deep-but-allowed": _tree(nested("<Inverter>", "</Inverter>", 990)),
        "attributes": _tree("<AlwaysSuccess " + " ".join(f'a{i}="1"' for i in range(50_000)) + "/>"),
        "laughs": '<!DOCTYPE r [<!ENTITY a "ha">' + "".join(f'<!ENTITY a{i} "{"&a" * 10}{i - 1 if i > 1 else ""};">' for i in range(1, 9)) + "]>" + _tree("&a8;"),
        "external": '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]>' + _tree("&x;"),
        "itself": _tree('<SubTree ID="Main"/>'),
        "each-other": _tree('<SubTree ID="B"/>', '<BehaviorTree ID="B"><SubTree ID="Main"/></BehaviorTree>'),
        "includes-itself": '<root BTCPP_format="4"><include path="mission.xml"/><BehaviorTree ID="Main"><AlwaysSuccess/></BehaviorTree><BehaviorTree ID="Main"><AlwaysSuccess/></BehaviorTree></root>',
        "includes-device": '<root BTCPP_format="4"><include path="/dev/zero"/><BehaviorTree ID="Main"><AlwaysSuccess/></BehaviorTree></root>',
        "script-deep": _tree('<Script code="x := ' + nested("(", ")", 60_000, "1") + '"/>'),
        "script-minus": _tree('<Script code="x := ' + "-" * 60_000 + '1"/>'),
        "script-long": _tree('<Script code="x := 1' + "+ " * 60_000 + '"/>'),
        "format": '<root BTCPP_format="1e99"><BehaviorTree ID="Main"><Nothing/></BehaviorTree></root>',
        "doubling": _tree('<SubTree ID="T0"/>', "".join(f'<BehaviorTree ID="T{i}"><Sequence><SubTree ID="T{i + 1}"/><SubTree ID="T{i + 1}"/></Sequence></BehaviorTree>' for i in range(40))
                          + '<BehaviorTree ID="T40"><AlwaysSuccess/></BehaviorTree>'),
        "unclosed": '<root BTCPP_format="4"><BehaviorTree ID="Main"><Sequence>',
        "attribute-twice": _tree('<AlwaysSuccess name="a" name="b"/>'),
        "wrong-number": _tree('<Repeat num_cycles="1e99"><AlwaysSuccess/></Repeat>'),
        "wrong-delay": _tree('<Delay delay_msec="-99999999999999999999"><AlwaysSuccess/></Delay>'),
    },
    "chart": {
        "deep": _chart("".join(f'<state id="s{i}">' for i in range(50_000)) + "</state>" * 50_000),
        "no-target": _chart('<state id="a"><transition target="nowhere"/></state>'),
        "initial-nowhere": _chart('<state id="a"/>', ' initial="nowhere"'),
        "same-id": _chart('<state id="a"/><state id="a"/>'),
        "script-deep": _chart('<datamodel><data id="d" expr="' + nested("(", ")", 50_000, "1") + '"/></datamodel><state id="a"/>'),
        "array-deep": _chart('<datamodel><data id="d" expr="' + nested("[", "]", 50_000) + '"/></datamodel><state id="a"/>'),
        "script-wrong": _chart('<script>function (</script><state id="a"/>'),
        "src-device": _chart('<script src="/dev/zero"/><state id="a"/>'),
        "data-src": _chart('<datamodel><data id="d" src="/dev/random"/></datamodel><state id="a"/>'),
        "unclosed": '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0"><state id="a">',
        "datamodel": '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="cobol"><state id="a"><onentry><log expr="1"/></onentry></state></scxml>',
        "parallel-history": _chart('<parallel id="p"><history id="h"><transition target="h"/></history></parallel>'),
    },
    "requirement": {
        "parentheses": "r: always " + nested("(", ")", 50_000, "reply(a.b) >= 1") + ".",
        "not": "r: always " + "not " * 50_000 + "reply(a.b).\n",
        "unended": "r: always",
        "numbers": "r: always reply(battery.getBatteryState).percentage >= 1" + "0" * 400 + " % within 1e999 s.\n",
        "lets": "let a = b\nlet b = a\nr: always a.\n",
    },
    "thrift": {
        "lists": "struct S { 1: " + nested("list<", ">", 30_000, "i32") + " a }\n",
        "constant": "const list<i32> L = " + nested("[", "]", 50_000) + "\n",
        "itself": 'include "robot.thrift"\nservice Battery extends robot.Battery {}\n',
        "self-typedef": "typedef A B\ntypedef B A\nservice Battery { A a() }\n",
        "extends-itself": "service Battery extends Battery {}\n",
        "number": "enum E { A = 99999999999999999999 }\nservice Battery {}\n",
        "ids": "service Battery { void a(99999: i32 x, -1: i32 y, 1: i32 z, 1: i32 w) }\n",
        "device": 'include "/dev/zero"\nservice Battery {}\n',
        "unclosed": "service Battery { void a(",
        "struct-in-itself": "struct S { 1: S s }\nservice Battery { S a() }\nservice Battery { S b() }\n",
    },
    "project": {
        "anchors": "mission: &a [" + "x," * 60 + "]\n" + "".join(f"k{i}: &b{i} [" + (f"*b{i - 1}," if i else "*a,") * 60 + "]\n" for i in range(9)),
        "anchor-in-itself": "mission: &a [*a]\n",
        "list": "- a\n- b\n", "number": "17\n", "text": "mission\n", "null": "~\n", "documents": "mission: mission.xml\n---\nmission: mission.xml\n",
        "wrong-types": "mission: [1, 2]\nservices: 3\nmonitors: {a: b}\nskills: [x]\n",
        "rate": "mission: {file: mission.xml, rate: 1e300 Hz}\n", "no-rate": "mission: {file: mission.xml, rate: 0 Hz}\n",
        "itself": "mission: sentree.yaml\n", "folder": "mission: .\n", "device": "mission: /dev/zero\n", "terminal": "mission: /dev/tty\n",
        "pattern": "mission: {files: ['" + "*" * 3000 + "b'], tree: Main}\n", "tag": "mission: !!python/object/apply:os.system ['id']\n",
        "world-device": "mission: mission.xml\nworld: /dev/zero\n", "plugin": "mission: mission.xml\nplugins: [/etc/passwd]\n",
        "key-twice": "mission: mission.xml\nmission: mission.xml\n", "tabs": "mission:\n\tfile: mission.xml\n",
    },
    "scenario": {
        "itself": "project: attacked.yaml\n", "device": "project: /dev/zero\n", "wrong-types": "duration: [1]\ntimeline: 5\nexpect: x\n",
        "durations": "duration: 1e300 s\n", "negative": "duration: -5 s\n", "seed": "seed: -1\n", "seed-large": "seed: 99999999999999999999999\n",
        "clock": "clock: {real: 1e300}\n", "at": "duration: 1 s\ntimeline:\n  - {at: 1e300 s, stop: mission}\n", "count": "duration: 1 s\ntimeline:\n  - {at: 0 s, delay: {message: '*', by: 1 s, count: -1}}\n",
        "stars": "duration: 1 s\ntimeline:\n  - {at: 0 s, delay: {message: '" + "*a" * 2000 + "', by: -1 s}}\n",
        "many": "duration: 1 s\ndelays: [" + "{message: '*', by: 1 s}," * 300 + "]\n",
        "process": "duration: 1 s\nprocesses: {p: {skill: Nobody, listen: 'unix:" + "/a" * 300 + "'}}\n",
    },
    "world": {
        "numbers": "map: {occupancy: nowhere.yaml}\nrobots: [{radius: -1}]\n", "size": "map: room.yaml\nbattery: {initial: 1e999 %, capacity: 0}\n", "text": "world\n",
        "device": "map: /dev/zero\n", "itself": "map: world.yaml\n",
    },
    "map": {
        "resolution": "image: room.pgm\nresolution: 0\norigin: [0, 0, 0]\n", "tiny": "image: room.pgm\nresolution: 1e-300\norigin: [0, 0, 0]\n",
        "huge": "image: room.pgm\nresolution: 1e300\norigin: [1e308, -1e308, 1e308]\n", "nan": "image: room.pgm\nresolution: .nan\norigin: [.inf, 0, 0]\n",
        "device": "image: /dev/zero\nresolution: 0.05\norigin: [0, 0, 0]\n", "origin": "image: room.pgm\nresolution: 0.05\norigin: 3\n",
    },
    "image": {
        "size": b"P5\n99999999 99999999\n255\n", "size-64": b"P5\n4294967296 4294967296\n255\n\0\0", "negative": b"P5\n-1 -1\n255\n", "none": b"P5\n0 0\n255\n",
        "short": b"P5\n100 100\n255\nxx", "depth": b"P5\n2 2\n99999999\n\0\0\0\0", "comment": b"P5\n" + b"#" * 200_000, "text": b"P2\n2 2\n255\n1 2 3",
    },
    "campaign": {
        "wrong-types": "vary: 3\nruns: x\n", "runs": "runs: 99999999999999999999\n", "negative": "runs: -1\n", "text": "x\n",
        "range": "runs: 2\nvary:\n  world.battery.initial: {uniform: [1e999, -1e999]}\n",
        "many": "runs: 2\nvary:\n" + "".join(f"  world.k{i}: {{uniform: [0, 1]}}\n" for i in range(3000)),
    },
}


# ---- recordings

def parts_of_mcap(octets):
    """Records (opcode, content) of a recording, with those of its chunks in their places, unpacked by the tools zstd and lz4."""
    records, at = [], 8
    while at + 9 <= len(octets) - 8:
        opcode, size = octets[at], struct.unpack_from("<Q", octets, at + 1)[0]
        content = octets[at + 9:at + 9 + size]
        at += 9 + size
        if opcode == 6:
            name_size = struct.unpack_from("<I", content, 28)[0]
            name = content[32:32 + name_size].decode()
            packed = content[32 + name_size + 8:]
            inside = subprocess.run([name, "-dc"], input=packed, stdout=subprocess.PIPE).stdout if name else packed
            records.append((6, content[:24], inside))
        else:
            records.append((opcode, content, None))
    return records


def as_mcap(records):
    out = b"\x89MCAP0\r\n"
    for opcode, content, inside in records:
        if inside is not None:  # a checksum of zero is none
            content = content[:16] + struct.pack("<QII", len(inside), 0, 0) + struct.pack("<Q", len(inside)) + inside
        elif opcode == 9:  # attachment, likewise
            content = content[:-4] + bytes(4)
        elif opcode == 15:
            content = bytes(4)
        elif opcode == 2:
            content = content[:16] + bytes(4)
        out += bytes([opcode]) + struct.pack("<Q", len(content)) + content
    return out + b"\x89MCAP0\r\n"


SIZES = (0, 1, 0x7F, 0xFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 0x7FFFFFFFFFFFFFFF, 0xFFFFFFFFFFFFFFFF)


def slipped_octets(octets, chance):
    octets = bytearray(octets)
    for _ in range(chance.choice((1, 2, 8))):
        if not octets:
            break
        at, what = chance.randrange(len(octets)), chance.randrange(6)
        if what == 0:
            octets[at] = chance.randrange(256)
        elif what == 1:
            octets[at] ^= 1 << chance.randrange(8)
        elif what == 2:
            octets[at:at + 8] = struct.pack("<Q", chance.choice(SIZES))[:len(octets[at:at + 8])]
        elif what == 3:
            octets[at:at + 4] = struct.pack("<I", chance.choice(SIZES) & 0xFFFFFFFF)[:len(octets[at:at + 4])]
        elif what == 4:
            del octets[at:at + chance.randrange(1, 64)]
        else:
            octets[at:at] = octets[at:at + chance.randrange(1, 64)]
    return bytes(octets)


def slipped_mcap(octets, records, chance):
    """A recording with slips that its checksums do not tell, or with slips of any kind."""
    if chance.random() < 0.3:
        return slipped_octets(octets, chance)
    if chance.random() < 0.1:
        return octets[:chance.randrange(len(octets))]
    records = list(records)
    for _ in range(chance.choice((1, 1, 3))):
        at = chance.randrange(len(records))
        opcode, content, inside = records[at]
        what = chance.randrange(6)
        if what == 0:
            del records[at]
        elif what == 1:
            records.insert(chance.randrange(len(records)), records[at])
        elif what == 2:
            records[at] = (chance.randrange(16), content, inside)
        elif inside is not None:
            if what == 3:
                text = mutated(inside.decode("latin-1"), chance)
                records[at] = (opcode, content, text.encode("latin-1", "replace"))
            else:
                records[at] = (opcode, content, slipped_octets(inside, chance))
        elif what == 3:
            records[at] = (opcode, mutated(content.decode("latin-1"), chance).encode("latin-1", "replace"), None)
        else:
            records[at] = (opcode, slipped_octets(content, chance), None)
    return as_mcap(records)
