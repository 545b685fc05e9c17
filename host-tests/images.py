"""Images of the real boards as a boot ROM takes them, checked without silicon. `host-tests/images` runs it.

Both Picos: the program as a UF2 file that `uf2conv` (adafruit-uf2) writes and another project (uf2utils) reads: family, blocks, and every
byte against the ELF file. Of an RP2040 also the check code of the second stage that its boot ROM wants, of an RP2350 the block loop that
says what the image is; vectors that lie in RAM and flash. ESP32-C3 and C6: the image that esptool makes, and what esptool says of its check code, hash and
entry when it reads it again; every byte against the ELF file. An image with one bit turned must be refused.

`picotool` is in none of the registries of Debian 12, Python, JavaScript and Rust; `espflash` is Rust's alone, and takes minutes to build.
"""

import logging
import re
import struct
import subprocess
import sys
from pathlib import Path

from elftools.elf.elffile import ELFFile
from uf2utils.file import UF2File

logging.disable(logging.CRITICAL)
BOARDS = Path("target/boards")
OUT = Path("target/images")
TOOLS = Path(sys.executable).parent
FLASH = 0x1000_0000
# Triple, family by the UF2 list, flash (bytes), RAM (end).
PICOS = {
    "pico": ("thumbv6m-none-eabi", 0xE48B_FF56, 2 << 20, 0x2004_2000),
    "pico-embassy": ("thumbv6m-none-eabi", 0xE48B_FF56, 2 << 20, 0x2004_2000),
    "pico2": ("thumbv8m.main-none-eabihf", 0xE48B_FF59, 4 << 20, 0x2008_2000),
}
ESPS = {
    "esp32-c3": ("riscv32imc-unknown-none-elf", "esp32c3"),
    "esp32-c6": ("riscv32imac-unknown-none-elf", "esp32c6"),
}


class Refused(Exception):
    """An image that a boot ROM would not start, or that is not the program."""


def want(holds, why):
    if not holds:
        raise Refused(why)


def loaded(elf_file):
    """Entry and loaded pieces of a program: address in the image, bytes."""
    with open(elf_file, "rb") as file:
        elf = ELFFile(file)
        pieces = [
            (segment["p_paddr"], segment["p_vaddr"], segment.data())
            for segment in elf.iter_segments()
            if segment["p_type"] == "PT_LOAD" and segment["p_filesz"] > 0
        ]
        return elf["e_entry"], sorted(pieces)


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def flat(pieces):
    """The bytes from the start of the flash on."""
    end = max(address + len(data) for address, _, data in pieces)
    image = bytearray(end - FLASH)
    for address, _, data in pieces:
        image[address - FLASH : address - FLASH + len(data)] = data
    return bytes(image)


def second_stage(image):
    """An RP2040's boot ROM starts the first 256 bytes where their last four are a CRC-32 of the others."""
    crc = 0xFFFF_FFFF
    for byte in image[:252]:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ 0x04C1_1DB7 if crc & 0x8000_0000 else crc << 1) & 0xFFFF_FFFF
    want(crc == int.from_bytes(image[252:256], "little"), "the second stage's check code is wrong")


def block_loop(image):
    """An RP2350's boot ROM looks in the first 4 KB for a block, follows the loop of blocks, and wants an image's definition."""
    words = struct.unpack(f"<{len(image) // 4}I", image[: len(image) // 4 * 4])
    start = next((k for k, word in enumerate(words[:1024]) if word == 0xFFFF_DED3), None)
    want(start is not None, "no block in the first 4 KB")
    at, seen, kinds = start, [], []
    while at not in seen:
        seen.append(at)
        want(0 <= at < len(words) and words[at] == 0xFFFF_DED3, "the loop leads to no block")
        item = at + 1
        while words[item] & 0xFF != 0xFF:
            if words[item] & 0xFF == 0x42:
                kinds.append(words[item] >> 16)
            # Types from 128 on have a length of 16 bits.
            size = words[item] >> 8 & (0xFFFF if words[item] & 0x80 else 0xFF)
            want(size > 0, "an item without a length")
            item += size
        want(words[item] >> 8 & 0xFFFF == item - at - 1, "the last item says another length")
        want(words[item + 2] == 0xAB12_3579, "a block without its end")
        offset = struct.unpack("<i", struct.pack("<I", words[item + 1]))[0]
        at += offset // 4
    want(at == start, "the loop does not close")
    # An executable image, secure, for Arm, for an RP2350.
    want(kinds == [0x1021], f"image types {kinds}")
    return len(seen)


def vectors(image, at, ram_end):
    stack, reset = struct.unpack_from("<II", image, at)
    want(0x2000_0000 < stack <= ram_end and stack % 8 == 0, f"the stack begins at {stack:#x}")
    want(reset & 1 == 1 and FLASH + at < reset < FLASH + len(image), f"the program begins at {reset:#x}")


def uf2(image, family, name):
    """Writes an image as UF2 by one project, reads it by another."""
    binary, made = OUT / f"{name}.bin", OUT / f"{name}.uf2"
    binary.write_bytes(image)
    status, said = run(TOOLS / "uf2conv", "-c", "-b", hex(FLASH), "-f", hex(family), "-o", made, binary)
    want(status == 0, said)
    blocks = list(UF2File(str(made)))
    want(made.stat().st_size == 512 * len(blocks), "not whole blocks")
    back = bytearray()
    for number, block in enumerate(blocks):
        head = block.header
        want(head.flags == 0x2000 and head.family.id == family, f"block {number} is for {head.family}")
        want((head.block_number, head.total_blocks, head.payload_size) == (number, len(blocks), 256), f"block {number} is {head}")
        want(head.address == FLASH + 256 * number, f"block {number} lies at {head.address:#x}")
        back += block.payload[:256]
    want(back[: len(image)] == image and not any(back[len(image) :]), "what was read is another image")
    return len(blocks)


def pico(name, turned=None):
    triple, family, flash_bytes, ram_end = PICOS[name]
    _, pieces = loaded(BOARDS / triple / "release" / name)
    want(all(FLASH <= address and address + len(data) <= FLASH + flash_bytes for address, _, data in pieces), "not in flash")
    image = bytearray(flat(pieces))
    if turned is not None:
        image[turned] ^= 1
    image = bytes(image)
    if family == 0xE48B_FF56:
        second_stage(image)
        vectors(image, 256, ram_end)
        told = "its second stage's check code is right"
    else:
        told = f"{block_loop(image)} blocks in its loop"
        vectors(image, 0, ram_end)
    return f"{name}: {len(image)} bytes, {uf2(image, family, name)} blocks of UF2, {told}"


def esp(name, turned=None):
    triple, chip = ESPS[name]
    elf_file, made = BOARDS / triple / "release" / name, OUT / f"{name}.bin"
    entry, pieces = loaded(elf_file)
    status, said = run(TOOLS / "esptool", "--chip", chip, "elf2image", "--flash-size", "4MB", "-o", made, elf_file)
    want(status == 0, said)
    image = bytearray(made.read_bytes())
    if turned is not None:
        image[turned] ^= 1
        made.write_bytes(image)
    status, said = run(TOOLS / "esptool", "--chip", chip, "image-info", made)
    want(status == 0, said)
    want(re.search(r"Checksum: 0x[0-9a-f]+ \(valid\)", said), f"check code: {said}")
    want(re.search(r"Validation hash: [0-9a-f]+ \(valid\)", said), f"hash: {said}")
    want(re.search(rf"Entry point: {entry:#x}", said), f"entry: {said}")
    # Eight bytes of the head and sixteen of its second part, then the pieces.
    want(image[0] == 0xE9, "not an image")
    at, there = 24, {}
    for _ in range(image[1]):
        address, size = struct.unpack_from("<II", image, at)
        there[address] = bytes(image[at + 8 : at + 8 + size])
        at += 8 + size
    for _, address, data in pieces:
        start = max((start for start in there if start <= address), default=None)
        want(start is not None, f"nothing lies at {address:#x}")
        kept = there[start][address - start :]
        # The hash of the program is written into its description by esptool.
        differs = sum(one != other for one, other in zip(kept, data))
        want(len(kept) >= len(data) and differs <= 32, f"other bytes at {address:#x}")
    return f"{name}: {len(image)} bytes, {len(there)} pieces; esptool finds check code, hash and entry right"


def refuses(check, name, turned):
    try:
        check(name, turned)
    except Refused:
        return
    raise SystemExit(f"images: {name} with bit {turned} turned was taken")


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    try:
        for name in PICOS:
            print(pico(name))
        for name in ESPS:
            print(esp(name))
    except Refused as why:
        raise SystemExit(f"images: {name}: {why}")
    refuses(pico, "pico", 17)
    start = flat(loaded(BOARDS / PICOS["pico2"][0] / "release" / "pico2")[1]).index(struct.pack("<I", 0xFFFF_DED3))
    refuses(pico, "pico2", start)
    refuses(esp, "esp32-c3", 4096)


main()
