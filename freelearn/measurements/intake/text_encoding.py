"""The text in a file's bytes: its encoding, found where nobody says it, without what cannot be seen."""

from __future__ import annotations

import codecs
import re

from freelearn.errors import UserError

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
CONTROL = re.compile(r"[\x00-\x08\x0e-\x1b]")
# Text has at most so many control characters; more make it binary.
FEW = 20
# DOS ended texts so.
END_OF_FILE = "\x1a"
# Marks of order, joints and spaces without width, which are copied along from web pages and chats.
INVISIBLE = dict.fromkeys(map(ord, "\u200b\u200c\u200d\u200e\u200f\u2060\ufeff\u00ad"))


def _japanese(content: bytes) -> bool:
    """Whether bytes that are no UTF-8 are Shift-JIS: its leading bytes mean little in western texts."""
    high = [byte for byte in content if byte > 0x7F]
    leading = sum(0x81 <= byte <= 0x9F for byte in high)
    if leading < 2 or 3 * leading < len(high):
        return False
    try:
        content.decode("utf-8")
    except UnicodeError:
        try:
            content.decode("cp932")
        except UnicodeError:
            return False
        return True
    return False


def decoded(content: bytes, name: str, encoding: str | None) -> tuple[str, list[str]]:
    """The text, and a note where its encoding had to be guessed. Raises UserError where it is none."""
    guessed = next((code for mark, code in MARKS if content.startswith(mark)), None)
    if encoding is None and guessed is None and b"\0" in content[:4000]:
        odd, even = content[1:4000:2].count(0), content[0:4000:2].count(0)
        # Of western text in UTF-16 nearly every other byte is zero.
        half = 0.25 * min(len(content), 4000)
        guessed = "utf-16-le" if odd > half > even else "utf-16-be" if even > half > odd else None
    if encoding is None and guessed is None and _japanese(content):
        guessed = "cp932"
    control = ""
    for code in [encoding] if encoding else [guessed or "utf-8", "cp1252", "latin-1"]:
        try:
            text = content.decode(code)
        except LookupError:
            raise UserError(f"read.encoding = {encoding!r} is no encoding: write utf-8, utf-16 or cp1252.") from None
        except UnicodeError:
            continue
        text = text.translate(INVISIBLE).rstrip(END_OF_FILE)
        if found := CONTROL.search(text):
            control = (
                f"control character 0x{ord(found.group()):02X} on line {1 + text.count(chr(10), 0, found.start())}"
            )
            break
        notes = [] if code in ("utf-8", "utf-8-sig") or encoding else [f"{name}: read as {code} text."]
        return text, notes
    if encoding:
        raise UserError(f"{name} is not {encoding} text{control and f' ({control})'}: correct read.encoding.")
    if control and "0x00" not in control and len(CONTROL.findall(text)) <= FEW:
        raise UserError(f"{name} is damaged, or a binary file: {control}: delete it, or export the table again.")
    raise UserError(f"{name} is a binary file, not text: export the table as CSV, or save it as .xlsx.")
