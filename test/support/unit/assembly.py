"""What numba's compiler makes of a function for another processor."""

import re

import llvmlite.binding as llvm
from numba import njit

TRIPLE = "aarch64-unknown-linux-gnu"


def assembly_for(function, signature: str, triple: str = TRIPLE) -> list[str]:
    """Compile a function; return its instructions, words separated by single spaces."""
    compiled = njit(signature, error_model="numpy")(function)
    (intermediate,) = compiled.inspect_llvm().values()
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(triple).create_target_machine()
    # the function alone: what calls it from Python is made for this processor
    head, body = re.search(r"^(define [^\n]*@_ZN(?!7cpython)[^\n]*)\n(.*?^\})$", intermediate, re.M | re.S).groups()
    rest = re.sub(r"^define .*?^\}$", "", intermediate, flags=re.M | re.S)
    module = llvm.parse_assembly(f"{rest}\n{head}\n{body}\n")
    module.triple = triple
    module.data_layout = str(machine.target_data)
    text = machine.emit_assembly(module)
    return [" ".join(line.split()) for line in text.splitlines()]
