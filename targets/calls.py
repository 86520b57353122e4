#!/usr/bin/env python3
"""Reads a linked image of Arm: who calls whom, and what stack that takes. A circle of calls is an error.

calls.py objdump image entry ...      prints the bytes that the deepest chain of calls below the entries takes
"""
import re
import subprocess
import sys

WORDS = {"push": 4, "vpush": 8}


def frame(operation, rest):
    """The bytes by which an instruction lowers the stack pointer, all of a frame's by constants."""
    if operation in WORDS or (operation.startswith("stmdb") and rest.startswith("sp!")):
        names = re.search(r"{(.*)}", rest).group(1)
        size = 8 if "d" in names.split("-")[0] else 4
        count = 0
        for part in names.split(","):
            ends = [int(n) for n in re.findall(r"\d+", part)] if "-" in part else []
            count += ends[1] - ends[0] + 1 if ends else 1
        return size * count
    if operation.startswith("sub"):
        found = re.fullmatch(r"sp, (?:sp, )?#(\d+).*", rest)
        return int(found.group(1)) if found else 0
    found = re.search(r"\[sp, #-(\d+)\]!", rest)
    return int(found.group(1)) if found else 0


def read(objdump, image):
    """For each function its frame and what it calls or jumps to; None among these stands for a call by address."""
    text = subprocess.run([objdump, "-d", "--no-show-raw-insn", image], capture_output=True, text=True, check=True)
    functions, name = {}, None
    for line in text.stdout.splitlines():
        if head := re.fullmatch(r"[0-9a-f]+ <(.*)>:", line):
            name = head.group(1)
            functions[name] = [0, set()]
        elif step := re.match(r"\s*[0-9a-f]+:\s+(\S+)\s*(.*)", line):
            operation, rest = step.groups()
            functions[name][0] += frame(operation, rest)
            if target := re.search(r"<([^>+]*)(\+0x[0-9a-f]+)?>", rest):
                if operation.startswith("b") and not target.group(2) and target.group(1) != name:
                    functions[name][1].add(target.group(1))
            elif operation.startswith("blx"):
                functions[name][1].add(None)
            if operation == "bl" and f"<{name}>" in rest:
                functions[name][1].add(name)
    return functions


def deepest(functions, name, above, known):
    if name in above:
        sys.exit("a circle of calls: " + " -> ".join(above[above.index(name):] + [name]))
    if name not in known:
        own, callees = functions[name]
        if None in callees:
            print(f"{name} calls by address", file=sys.stderr)
        below = [deepest(functions, callee, above + [name], known) for callee in callees if callee in functions]
        size, chain = max(below, default=(0, []))
        known[name] = own + size, [(name, own)] + chain
    return known[name]


def main():
    objdump, image, *entries = sys.argv[1:]
    functions = read(objdump, image)
    size, chain = max(deepest(functions, entry, [], {}) for entry in entries)
    for name, own in chain:
        print(f"{own:7} {name}", file=sys.stderr)
    print(size)


main()
