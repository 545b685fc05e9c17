"""Worst-case stack of a board's programs: the compiler's frame sizes, added up along the deepest path of the call graph.

usage: host-tests/stack [--json]      (needs Python 3.9 and pip; fetches capstone and pyelftools)

Frames are what rustc writes with `-Z emit-stack-sizes`; of functions that come compiled (memcpy, runtimes), what their
instructions take from the stack pointer. Calls are read from the linked program's instructions. What is called through a
pointer may be any function whose address the program holds. A recursion that can be reached has no bound: it fails.
"""

import argparse
import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import capstone
from elftools.elf.elffile import ELFFile

ROOT = Path(__file__).resolve().parent.parent
THUMB = (capstone.CS_ARCH_ARM, capstone.CS_MODE_THUMB)
RISCV = (capstone.CS_ARCH_RISCV, capstone.CS_MODE_RISCV32 | capstone.CS_MODE_RISCVC)
# Row of the card, package, target, instructions, what an interrupt stacks by itself (bytes; with a floating-point unit its registers
# too), RAM.
BOARDS = [
    ("m4f", "qemu-m4f", "thumbv7em-none-eabihf", (THUMB[0], THUMB[1] | capstone.CS_MODE_MCLASS), 104, 4 << 20),
    ("m0", "qemu-m0", "thumbv6m-none-eabi", (THUMB[0], THUMB[1] | capstone.CS_MODE_MCLASS), 32, 16 << 10),
    ("rv32", "qemu-rv32", "riscv32imc-unknown-none-elf", RISCV, 0, 4 << 20),
    ("m0z", "bluepill", "thumbv7m-none-eabi", (THUMB[0], THUMB[1] | capstone.CS_MODE_MCLASS), 32, 20 << 10),
]
# What interrupts main, in the firmware that has interrupts.
HANDLERS = ("DefaultHandler", "SysTick", "USART1", "USART2")


def uleb(data, at):
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            return value, at


class Program:
    def __init__(self, path, instructions):
        self.is_arm = instructions[0] == capstone.CS_ARCH_ARM
        self.decoder = capstone.Cs(*instructions)
        self.decoder.skipdata = True
        with open(path, "rb") as file:
            elf = ELFFile(file)
            sections = [(s["sh_addr"], s.data(), s["sh_flags"]) for s in elf.iter_sections() if s["sh_flags"] & 2 and s["sh_type"] == "SHT_PROGBITS"]
            # riscv-rt has sections for what is left of the RAM.
            left = (".heap", ".stack")
            self.statics = sum(s["sh_size"] for s in elf.iter_sections() if s["sh_flags"] & 1 and s.name not in left)
            sizes = elf.get_section_by_name(".stack_sizes").data()
            symbols = [(s["st_value"], s["st_size"], s["st_info"]["type"], s.name) for s in elf.get_section_by_name(".symtab").iter_symbols()]
        self.frames, at = {}, 0
        while at < len(sizes):
            (address,) = struct.unpack_from("<I", sizes, at)
            size, at = uleb(sizes, at + 4)
            self.frames[self.even(address)] = size
        code = [(start, data) for start, data, flags in sections if flags & 4]
        data = [value for start, content, flags in sections for (value,) in struct.iter_unpack("<I", content[: len(content) & ~3])]
        self.functions, named = {}, {}
        for address, size, kind, name in symbols:
            if kind == "STT_FUNC" or (kind == "STT_NOTYPE" and not name.startswith("$") and any(s <= address < s + len(d) for s, d in code)):
                address = self.even(address)
                if size or address not in named:
                    named[address] = (size, name)
        # What is written in assembly has no size: it goes on to the next name.
        starts = sorted(named)
        # Places of data within code: a literal is no instruction.
        literals = sorted((a, n.startswith("$d")) for a, _, _, n in symbols if n.startswith(("$d", "$t", "$x")))
        for start, following in zip(starts, starts[1:] + [max(s + len(d) for s, d in code)]):
            size, name = named[start]
            size = size or following - start
            for base, content in code:
                if base <= start < base + len(content):
                    self.functions[start] = (name, self.instructions(start, content[start - base : start - base + size], literals))
        # A function whose address is held somewhere may be called through a pointer.
        taken = {self.even(value) for value in data if not self.is_arm or value & 1}
        self.pointed = sorted(taken & set(self.functions) & set(self.frames))
        self.calls, self.indirect = {}, {}
        for start, (name, code) in self.functions.items():
            self.read(start, code)

    def even(self, address):
        return address & ~1 if self.is_arm else address

    def instructions(self, start, content, literals):
        """Instructions of a function, without the data between them."""
        out, at = [], start
        end = start + len(content)
        marks = [(a, d) for a, d in literals if start <= a < end]
        for place, is_data in marks + [(end, False)]:
            if at < place:
                out.extend(self.decoder.disasm(content[at - start : place - start], at))
            at = place
            if is_data:
                following = [a for a, d in marks if a > place and not d]
                at = following[0] if following else end
        return out

    def read(self, start, code):
        """Who is called, and by what a compiled function's stack grows."""
        calls, indirect, depth, deepest, upper = set(), False, 0, 0, {}
        end = code[-1].address + code[-1].size if code else start
        for at in code:
            name, operands = at.mnemonic.removeprefix("c."), at.op_str
            target = None
            if self.is_arm:
                stem = name.split(".")[0]
                if stem == "push" or stem == "vpush":
                    width = 8 if "d" in operands and stem == "vpush" else 4
                    depth += width * registers(operands)
                elif stem == "sub" and operands.startswith("sp") and "#" in operands:
                    depth += int(operands.split("#")[1], 0)
                if stem in ("bl", "blx", "b") or (stem.startswith("b") and stem[1:] in CONDITIONS) or stem in ("cbz", "cbnz"):
                    if "#" in operands:
                        target = int(operands.split("#")[1], 0)
                    elif stem != "b":
                        indirect = True
                elif stem == "bx" and operands != "lr":
                    indirect = True
            else:
                fields = [field.strip() for field in operands.split(",")]
                if name in ("addi", "addi16sp") and fields[0] == "sp":
                    depth += max(0, -int(fields[-1], 0))
                if name == "auipc":
                    upper[fields[0]] = at.address + (int(fields[1], 0) << 12)
                elif name in ("jal", "j"):
                    target = at.address + int(fields[-1], 0)
                elif name in ("jalr", "jr"):
                    base = fields[-1].split("(")[-1].rstrip(")") if "(" in operands else (fields[1] if len(fields) > 1 else fields[0])
                    offset = fields[-1].split("(")[0] if "(" in operands else (fields[2] if len(fields) > 2 else "0")
                    if base in upper:
                        target = (upper[base] + int(offset or "0", 0)) & 0xFFFF_FFFF
                    elif base not in ("ra", "t0"):
                        indirect = True
                    # A call leaves its return address there: what follows is a return.
                    upper.pop("ra", None)
            deepest = max(deepest, depth)
            if target is not None and not start <= target < end:
                calls.add(target)
        self.calls[start] = calls
        self.indirect[start] = indirect
        if start not in self.frames:
            self.frames[start] = deepest

    def name(self, start):
        name = self.functions[start][0]
        try:
            return subprocess.run(["c++filt", name], capture_output=True, text=True, check=True).stdout.strip()
        except OSError:
            return name

    def deepest(self, root):
        """Bytes and path of the deepest calls from a function."""
        known, path = {}, []

        def follow(start):
            if start in known:
                return known[start]
            if start not in self.functions:
                return (0, [])
            if start in path:
                circle = path[path.index(start) :] + [start]
                raise SystemExit("stack: a recursion: " + " -> ".join(self.name(at) for at in circle))
            path.append(start)
            best = (0, [])
            callees = set(self.calls[start])
            if self.indirect[start]:
                callees.update(self.pointed)
            for callee in callees:
                callee = self.even(callee)
                if callee in self.functions:
                    best = max(best, follow(callee), key=lambda found: found[0])
            path.pop()
            known[start] = (self.frames[start] + best[0], [start] + best[1])
            return known[start]

        return follow(root)


CONDITIONS = {"eq", "ne", "hs", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le", "cs", "cc", "al"}


def registers(operands):
    """Number of registers in `{r4, r5-r7, lr}`."""
    count = 0
    for field in operands.strip("{}").split(","):
        first, _, last = field.strip().partition("-")
        count += int(last[1:]) - int(first[1:]) + 1 if last else 1
    return count


def build(package, target):
    """The firmware, the emulated boards' proven free of panics: nothing in it formats text, and hardly anything is called through a pointer."""
    environment = {**os.environ, "RUSTC_BOOTSTRAP": "1", "CARGO_PROFILE_RELEASE_DEBUG": "0"}
    proof = ["--features", "prove-no-panic"] if package.startswith("qemu") else []
    command = ["cargo", "rustc", "--quiet", "--release", "--bin", package, *proof]
    command += ["--target-dir", ROOT / "target/boards", "--", "-Z", "emit-stack-sizes"]
    subprocess.run(command, cwd=ROOT / "boards" / package, env=environment, check=True)
    return ROOT / "target/boards" / target / "release" / package


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--json", action="store_true", help="one JSON object")
    options = arguments.parse_args()
    card = {row["board"]: row for row in json.loads((ROOT / "host-tests/golden/card.json").read_text())}
    rows, broken = [], []
    for board, package, target, instructions, stacked, ram in BOARDS:
        found = Program(build(package, target), instructions)
        roots = {name: start for start, (name, _) in found.functions.items()}
        bytes, way = found.deepest(roots["main"])
        # One interrupt at a time: all have the same priority.
        handlers = [found.deepest(roots[name])[0] for name in HANDLERS if name in roots]
        interrupt = stacked + max(handlers) if handlers else 0
        painted = card[board]["stack_bytes"]
        rows.append({"board": board, "stack_bytes": bytes, "interrupt_bytes": interrupt, "painted_bytes": painted})
        if not options.json:
            print(f"{board}: {bytes} bytes from main, {interrupt} in an interrupt; {painted} seen when painted")
            for start in way:
                print(f"  {found.frames[start]:5} {found.name(start)}")
        if painted > bytes:
            broken.append(f"{board}: {painted} bytes were seen, more than the {bytes} computed")
        if found.statics + bytes + interrupt > ram:
            broken.append(f"{board}: {found.statics} bytes of statics, {bytes} of stack, {interrupt} in an interrupt: {ram} there are")
    if options.json:
        print(json.dumps(rows))
    if broken:
        sys.exit("stack: " + "; ".join(broken))


if __name__ == "__main__":
    main()
