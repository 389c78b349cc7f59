"""Case and sweep files with mistakes, and HDF5 files whose headers were changed, with checksums that fit."""

import random
import re
from functools import cache

VALUES = [
    *(
        "0",
        "-1",
        "1e999",
        "-nan",
        "inf",
        "1e-320",
        "5e-324",
        "1e308",
        "-0.0",
        "1_000",
        "0x10",
        "9" * 23,
        "+1",
        "1.",
    ),
    *(
        "true",
        '""',
        '"x"',
        "'''a\nb'''",
        r'"\u202e"',
        r'"\u001b[2J"',
        r'"\u0000"',
        r'"\ud800"',
        "=",
        '"open',
        "'",
        "{",
    ),
    *(
        "1979-05-27",
        "1979-05-27T07:32:00Z",
        "07:32:00",
        "9999-99-99",
        "[]",
        "[1]",
        "[[1]]",
        "[nan]",
        "[1, 'a']",
        "{}",
    ),
    *(
        "{a = 1}",
        "[{}]",
        "{a = {b = {c = 1}}}",
        "[1e-6, 1e-6]",
        "1e-100",
        "1e100",
        "1e101",
        "[0.0, 0.0]",
        "1e6",
        "1e-9",
    ),
    *(
        "'two-layer'",
        "'auto'",
        "'paper'",
        "'equilibrium'",
        "'midpoint'",
        "'exact'",
        "[1, 2, ]",
        str(2**63 - 1),
        "[",
        "]",
    ),
]
KEYS = [
    *(
        "mass",
        "shoe",
        "force",
        "forces",
        "times",
        "angular_speed",
        "stiffness",
        "damping",
        "angle_deg",
        "nodes",
        "nmu",
    ),
    *(
        "amplitudes",
        "wavelengths",
        "phases_deg",
        "x",
        "at",
        "scheme",
        "theta",
        "start",
        "step",
        "tolerance",
        "title",
    ),
    *(
        "duration",
        "sample_interval",
        "case",
        "axis",
        "parameter",
        "num",
        "stop",
        "values",
        "spacing",
        "direction",
        "1",
    ),
    *(
        "critical",
        "lower",
        "upper",
        "method",
        "solver",
        "roughness",
        "wheel",
        "load",
        "link1",
        "output",
        "contact",
        "-",
    ),
    *("initial", '""', r'"\u202e"', '"a b"', "ü", "масса", "a.b.c"),
]
ODD = "\x00\x1b\x07\u202e\u2066\ufeff\x85\u2028\x9bé[]{}\"'=.,#\\\t\r-+eE_9 "
NUMBER = re.compile(r"-?\d[\d.e+-]*")


def mutated(text: str, chance: random.Random) -> bytes:
    """A text with one to three mistakes, in its keys, headers, values, lines or bytes."""
    for _ in range(chance.choice((1, 1, 1, 1, 2, 3))):
        lines = text.split("\n")
        row = chance.choice([n for n, line in enumerate(lines) if "=" in line] or [0])
        key, _, value = lines[row].partition("=")
        match chance.randrange(12):
            case 0 | 1 | 2:
                lines[row] = f"{key}= {chance.choice(VALUES)}"
            case 3:
                lines[row] = f"{chance.choice(KEYS)} ={value}"
            case 4:
                lines.insert(chance.randrange(len(lines)), chance.choice(lines))
            case 5:
                del lines[row]
            case 6:
                header = chance.choice(KEYS)
                lines.insert(
                    chance.randrange(len(lines)), chance.choice((f"[{header}]", f"[[{header}]]", f"[{header}"))
                )
            case 7:
                lines.insert(chance.randrange(len(lines)), f"{chance.choice(KEYS)} = {chance.choice(VALUES)}")
            case 8:
                place = chance.randrange(len(lines[row]) + 1)
                lines[row] = lines[row][:place] + chance.choice(ODD) + lines[row][place + 1 :]
            case 9 if numbers := NUMBER.findall(value):
                number = chance.choice(numbers)
                new = chance.choice((f"{number}e30", f"-{number}", f"0{number}", f"{number}e-99", f"{number}000"))
                lines[row] = f"{key}={value.replace(number, new, 1)}"
            case 10:
                lines = [f"{line}\r" for line in lines]
            case _:
                lines[row:] = [lines[row][: chance.randrange(len(lines[row]) + 1)]]
        text = "\n".join(lines)
    data = bytearray(text.encode("utf-8", "surrogatepass"))
    if chance.random() < 0.05 and data:
        data[chance.randrange(len(data))] = chance.randrange(256)
    return bytes(data)


def with_another_header(data: bytes, chance: random.Random) -> bytes:
    """A result without its digest in which one to three bytes or lengths of an object's header were changed."""
    changed = bytearray(data)
    headers = _headers(data)
    for _ in range(chance.choice((1, 1, 2, 3))):
        start, first, end = chance.choice(headers)
        place = chance.randrange(first, end)
        size = min(chance.choice((1, 1, 4, 8)), end - place)
        number = chance.choice((chance.randrange(256), 0, 1 << 20, 1 << 31, 1 << 63, (1 << 64) - 1))
        changed[place : place + size] = number.to_bytes(8, "little")[:size]
        changed[end : end + 4] = _lookup3(bytes(changed[start:end])).to_bytes(4, "little")
    return bytes(changed)


@cache
def _headers(data: bytes) -> list[tuple[int, int, int]]:
    """Where object headers begin, where their messages do, and where these end and the checksum stands."""
    found = []
    for match in re.finditer(b"OHDR", data):
        start = match.start()
        flags = data[match.start() + 5]
        size_at = start + 6 + 16 * bool(flags & 0x20) + 4 * bool(flags & 0x10)
        first = size_at + (1 << (flags & 3))
        end = first + int.from_bytes(data[size_at:first], "little")
        if _lookup3(data[start:end]) == int.from_bytes(data[end : end + 4], "little"):
            found.append((start, first, end))
    assert found
    return found


def _lookup3(data: bytes) -> int:
    """Bob Jenkins' hash, the checksum of HDF5's metadata."""

    def turn(value: int, by: int) -> int:
        return (value << by | value >> (32 - by)) & 0xFFFFFFFF

    state = [(0xDEADBEEF + len(data)) & 0xFFFFFFFF] * 3
    for start in range(0, len(data), 12):
        block = data[start : start + 12].ljust(12, b"\0")
        state = [(state[n] + int.from_bytes(block[4 * n : 4 * n + 4], "little")) & 0xFFFFFFFF for n in range(3)]
        if start + 12 < len(data):
            for n, by in enumerate((4, 6, 8, 16, 19, 4)):
                one = n % 3
                other = (n + 2) % 3
                third = (n + 1) % 3
                state[one] = (state[one] - state[other]) & 0xFFFFFFFF ^ turn(state[other], by)
                state[other] = (state[other] + state[third]) & 0xFFFFFFFF
        else:
            for n, by in enumerate((14, 11, 25, 16, 4, 14, 24)):
                one = (n + 2) % 3
                other = (n + 1) % 3
                state[one] = ((state[one] ^ state[other]) - turn(state[other], by)) & 0xFFFFFFFF
    return state[2]
