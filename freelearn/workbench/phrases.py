"""What sentences of the commands call an option, in the words of the page."""

from __future__ import annotations

PHRASES = {
    "add data.bed=": "choose the bed ",
    "correct data.accuracy, or use data.accuracy=estimate": "state it in step 1, or let it be estimated from the data",
    "data.accuracy": "the accuracy of the measuring",
}


def as_on_the_page(text: str) -> str:
    """The sentence for a reader who has no command line before them.

    >>> as_on_the_page("repeats scatter 2 times as much as data.accuracy says")
    'repeats scatter 2 times as much as the accuracy of the measuring says'
    """
    for said, meant in PHRASES.items():
        text = text.replace(said, meant)
    return text
