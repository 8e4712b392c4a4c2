"""Plain words of YAML 1.2 (core schema) as values: `1e-3` is a number, `yes` is a text, `0777` is not octal."""

import re

from solfer.config.yaml.nodes import Scalar

_CONSTANTS: dict[str, Scalar] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), float("inf")),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), float("-inf")),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}
"""Words that are neither texts nor numbers of digits."""

CORE = "tag:yaml.org,2002:"
"""Begin of YAML's own tags."""


def resolve(text: str) -> Scalar:
    """Return the value of a word that stands without quotes."""
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    # 18 characters of an integer always fit 64 bits; a longer one is a float, or not a number
    if len(text) <= 18 and re.fullmatch(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", text):
        return int(text, 0) if text[:2] in ("0o", "0x") else int(text)
    return float(text) if re.fullmatch(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", text) else text


def tagged(text: str, tag: str) -> Scalar:
    """Return the value of a word with an explicit tag such as `!!str`.

    Raises:
        ValueError: The tag is not one of YAML's own for scalars, or the word does not fit it.
    """
    kind = tag[len(CORE) :] if tag.startswith(CORE) else tag
    if kind in ("str", "!"):
        return text
    kinds: dict[str, type | tuple[type, ...]] = {"null": type(None), "bool": bool, "int": int, "float": (int, float)}
    if kind not in kinds:
        raise ValueError(f"unknown tag '{tag}'")
    value = resolve(text)
    if not isinstance(value, kinds[kind]) or (kind != "bool" and isinstance(value, bool)):
        raise ValueError(f"'{text}' is not of the tag's kind '!!{kind}'")
    return float(value) if kind == "float" else value
