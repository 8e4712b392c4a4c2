"""Compilation with and without a place for the cache."""

import math
import runpy
import uuid

import pytest
from numba.core.cpu import CPUContext

from solfer.numerics.compilation import cached, digest


def test_functions_compile_without_a_cache():
    # numba keeps the cache beside the file of a function, or in a folder named after it: this one has no file
    namespace = {"math": math}
    exec("def hypotenuse(a, b):\n    return math.sqrt(a * a + b * b)\n", namespace)
    function = cached("float64(float64, float64)", namespace["hypotenuse"])
    assert function(3, 4) == 5.0
    assert len(function.signatures) == 1
    with pytest.raises(TypeError):
        function("three", 4.0)


def test_what_is_cached_needs_no_compiler(tmp_path, monkeypatch):
    file = tmp_path / f"double_{uuid.uuid4().hex}.py"  # that no earlier run has cached
    file.write_text("def double(value):\n    return 2.0 * value\n")

    def made():
        return cached("float64(float64)", runpy.run_path(str(file))["double"])

    assert made()(2.0) == 4.0
    monkeypatch.setattr(CPUContext, "load_additional_registries", lambda _: pytest.fail("the compiler is prepared"))
    assert made()(3.0) == 6.0


def test_the_digest_follows_the_contents_of_all_files(tmp_path):
    first, second = tmp_path / "a.py", tmp_path / "b.py"
    first.write_text("1")
    second.write_text("2")
    before = digest([first, second])
    assert digest([second, first]) == before
    second.write_text("3")
    assert digest([first, second]) != before
