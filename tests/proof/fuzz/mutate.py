"""Changes of inputs: bytes, text, numbers, keys, and mixtures of groups."""

import contextlib

from namelists import NUMBER, NotPlain, read, written

EXTREMES = (
    "0", "-0.0", "1e300", "-1e300", "1e-300", "1e99", "-1e99", "1e100", "1e-99", "1e-100", "1e101",
    "1e40", "1e20", "1e15", "1e10", "1e-10", "1e-20", "1e-30", "nan", "NaN", "inf", "-Inf",
    "Infinity", "2147483647", "2147483648", "-2147483648", "-2147483649", "4294967296",
    "9223372036854775807", "9223372036854775808", "1e19", "99999999999999999999999999", "5e-324",
    "2.2e-308", "1.8e308", "1d0", "1D-3", "1.0q0", "0x10", "1,5", "1_000", "1e", "1e+", "+", "-",
    ".", "--1", "1.2.3", "1/3", "50%", "1e5000", "3*1.0", "0*1.0", "1000000*1.0", "1", "-1", "2",
    "1.0000001", "0.9999999", "1e-7",
)  # fmt: skip
FACTORS = (
    -1.0, 0.0, 1e-9, 1e-3, 0.1, 0.3, 0.5, 0.9, 0.999999, 1.000001, 1.1, 1.5, 2.0, 3.0, 10.0, 1e3,
    1e6, 1e9, 1e30,
)  # fmt: skip
LETTERS = (
    b"\xe4", "ä".encode(), "\u00a0".encode(), "\u201c".encode(), "\u2019".encode(),
    "\u2212".encode(), b"\x00", b"\x1b", b"\x7f", b"\xff", b"\xef\xbb\xbf", b"'", b'"', b"/", b"&",
    b"!", b"=", b",", b"*", b"(", b")", b"%", b"#", b";", b"\t", b"\r", b"\n", b"\r\n", b"\\",
    b"&end\n", b"/\n&", b" / ", "𝛿".encode(), b"''", b"$",
)  # fmt: skip


# ------------------------------------------------------------------------------------ as text


def one_number(random, text):
    """Return a text with one of its numbers changed."""
    found = [m for m in NUMBER.finditer(text) if alone(text, m)]
    if not found:
        return text
    match = random.choice(found)
    return text[: match.start()] + other_number(random, match.group()) + text[match.end() :]


def alone(text, match):
    before, after = text[match.start() - 1 : match.start()], text[match.end() : match.end() + 1]
    return not (before.isalnum() or before == "_" or after.isalnum() or after == "_")


def other_number(random, number):
    """Return another number in place of one."""
    way = random.random()
    if way < 0.25:
        return random.choice(EXTREMES)
    value = float(number.lower().replace("d", "e"))
    if way < 0.9:
        value *= random.choice(FACTORS)
    else:
        value += random.choice((-1, 1)) * random.choice((1, 0.5, 1e-9, 2**31, 1e3))
    if value == int(value) and abs(value) < 1e17 and random.random() < 0.5:
        return str(int(value))
    return repr(value)


def one_word(random, text):
    """Return a text with a letter of a word doubled, lost, changed or swapped."""
    places = [i for i, letter in enumerate(text) if letter.isalpha()]
    if not places:
        return text
    i = random.choice(places)
    new = random.choice(("", 2 * text[i], random.choice("abcxyz_09"), text[i].swapcase()))
    if random.random() < 0.3:
        return text[:i] + text[i + 1 : i + 2] + text[i] + text[i + 2 :]
    return text[:i] + new + text[i + 1 :]


def one_line(random, text):
    """Return a text with a line lost, doubled, moved or cut."""
    lines = text.splitlines(keepends=True)
    if not lines:
        return text
    i, way = random.randrange(len(lines)), random.randrange(5)
    line = lines[i]
    if way == 0:
        del lines[i]
    elif way == 1:
        lines.insert(random.randrange(len(lines)), line)
    elif way == 2:
        lines.insert(random.randrange(len(lines)), lines.pop(i))
    elif way == 3:
        lines[i] = line[: random.randrange(len(line))]
    else:
        lines[i] = line * random.choice((2, 50, 2000))
    return "".join(lines)


def one_mark(random, text):
    """Return a text with a mark lost, doubled or exchanged."""
    places = [i for i, letter in enumerate(text) if letter in "&/='\",.!#[]{}\n"]
    if not places:
        return text
    i = random.choice(places)
    new = random.choice(("", 2 * text[i], random.choice("&/='\",.!*\n ;"), f" {text[i]} "))
    return text[:i] + new + text[i + 1 :]


def bytes_of(random, text):
    """Return a text as bytes: in another encoding, with other line ends, with foreign bytes."""
    way = random.randrange(8)
    if way == 0:
        text = text.replace("\n", random.choice(("\r\n", "\r", "\n\r", "\n\n", "\u2028", "\x0b")))
    if way == 1:
        text = text.replace(" ", random.choice(("\xa0", "\t", "  ", "\u2003")))
    encoding = "utf-8"
    if way == 2:
        encoding = random.choice(("utf-8-sig", "utf-16", "utf-32", "latin-1"))
        text = text.replace("e", "é", 1) if random.random() < 0.5 else text
    data = text.encode(encoding, "replace")
    if way in (3, 4):
        for _ in range(random.choice((1, 1, 2, 5))):
            at = random.randrange(len(data) + 1)
            data = data[:at] + random.choice(LETTERS) + data[at + random.choice((0, 1)) :]
    if way == 5:
        at = random.randrange(len(data) + 1)
        data = random.choice((data[:at], data[at:], data[:at] + data, data * 2))
    if way == 6:
        at = random.randrange(len(data) + 1)
        data = data[:at] + bytes(random.randrange(256) for _ in range(random.choice((1, 4, 64))))
    return data


TEXT_CHANGES = (one_number, one_number, one_word, one_line, one_mark)


def as_text(random, text):
    """Return the bytes of a text after some changes that know nothing of its meaning."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        text = random.choice(TEXT_CHANGES)(random, text)
    return bytes_of(random, text) if random.random() < 0.25 else text.encode()


# ------------------------------------------------------------------------------------ as groups


def plausible(random, key):
    """Return values that a key may have by itself, or nearly."""
    if key["choices"]:
        return [random.choice(key["choices"])]
    count = key["count"] or random.choice((1, 2, 3, 4, 6, 8))
    if key["type"] == "text":
        return [
            random.choice(("clay", "left", "right", "top", "soft", "a", "", "left=soft", "x y"))
        ]
    if key["type"] == "integer":
        return [float(random.choice((0, 1, 2, 3, 10, 1000))) for _ in range(count)]
    values = [random.choice((0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 10.0, 1e3, 1e5)) for _ in range(count)]
    if random.random() < 0.3:
        values = [-value for value in values]
    if random.random() < 0.3:
        values.sort()
    return values


def groups_changed(random, groups, others, reference):
    """Change a list of groups: keys and groups of others, doubled, lost, swapped, made up."""
    way = random.randrange(8)
    i = random.randrange(len(groups))
    name, keys = groups[i]
    if way == 0 and len(groups) > 1:
        del groups[i]
    elif way == 1:
        groups.insert(i, (name, dict(keys)))
    elif way == 2:
        groups.insert(i, random.choice(random.choice(others)))
    elif way == 3:
        _, more = random.choice(random.choice(others))
        if more:
            key = random.choice(list(more))
            keys[key] = list(more[key])
    elif way == 4 and name in reference:
        key = random.choice(list(reference[name]))
        keys[key] = plausible(random, reference[name][key])
    elif way == 5:
        new = random.choice(list(reference))
        chosen = [key for key in reference[new] if reference[new][key]["required"]]
        chosen += random.sample(list(reference[new]), min(2, len(reference[new])))
        groups.append((new, {key: plausible(random, reference[new][key]) for key in chosen}))
    elif way == 6 and keys:
        del keys[random.choice(list(keys))]
    elif way == 7 and len(keys) > 1:
        one, other = random.sample(list(keys), 2)
        keys[one], keys[other] = keys[other], keys[one]


def mixed(random, texts, reference):
    """Return an input whose groups come from several others."""
    others = [read(text) for text in texts]
    groups = [(name, dict(keys)) for name, keys in random.choice(others)]
    for _ in range(random.choice((0, 1, 1, 2))):
        if groups:
            groups_changed(random, groups, others, reference)
    if random.random() < 0.2:
        random.shuffle(groups)
    return written(groups)


def namelist(random, texts, reference):
    """Return the bytes of a changed input."""
    way = random.random()
    if way < 0.3:
        return as_text(random, random.choice(texts))
    text = mixed(random, texts, reference)
    if way > 0.5:
        with contextlib.suppress(NotPlain):
            text = one_number(random, text)
    if way > 0.9:
        return as_text(random, text)
    return text.encode()


# ------------------------------------------------------------------------------------ clouds


def cloud(random, text):
    """Return the bytes of a changed cloud of points."""
    way = random.random()
    if way < 0.5:
        return as_text(random, text)
    rows = [line.split() for line in text.splitlines()[1:]]
    for _ in range(random.choice((1, 1, 2, 5, 20))):
        row = random.choice(rows)
        k = random.randrange(3)
        way = random.randrange(7)
        if way == 0:
            row[k] = other_number(random, "0.25")
        elif way == 1:
            row[k] = random.choice(rows)[k]
        elif way == 2:
            rows.append(list(random.choice(rows)))
        elif way == 3 and len(rows) > 1:
            rows.remove(row)
        elif way == 4:
            row[3:] = [random.choice(("top", "bottom", "round", "0", "TOP", "a b", ""))]
        elif way == 5:
            factor = random.choice(FACTORS)
            if all(NUMBER.fullmatch(other[k]) for other in rows):
                for other in rows:
                    other[k] = repr(float(other[k].lower().replace("d", "e")) * factor)
        else:
            shift = random.choice((1e-9, 1.0, 1e6, 1e12, -5e5))
            if all(NUMBER.fullmatch(other[k]) for other in rows):
                for other in rows:
                    other[k] = repr(float(other[k].lower().replace("d", "e")) + shift)
    return ("# x y volume boundary\n" + "\n".join(map(" ".join, rows)) + "\n").encode()
