"""Links the archive for the board's processor, by what its compiler says of the flags in use."""

import os
import subprocess

Import("env")  # noqa: F821


def target(macros):
    """The Rust target of these predefined macros."""
    hard = "hf" if "__ARM_PCS_VFP" in macros else ""
    if "__ARM_ARCH_6M__" in macros:
        return "thumbv6m-none-eabi"
    if "__ARM_ARCH_7M__" in macros:
        return "thumbv7m-none-eabi"
    if "__ARM_ARCH_7EM__" in macros:
        return "thumbv7em-none-eabi" + hard
    if "__ARM_ARCH_8M_MAIN__" in macros:
        return "thumbv8m.main-none-eabi" + hard
    if macros.get("__riscv_xlen") == "32" and "__riscv_float_abi_soft" in macros:
        return "riscv32imac-unknown-none-elf" if "__riscv_atomic" in macros else "riscv32imc-unknown-none-elf"
    return None


flags = env.subst("$CCFLAGS $CFLAGS").split()  # noqa: F821
command = [env.subst("$CC")] + [f for f in flags if f.startswith("-m")] + ["-dM", "-E", "-x", "c", os.devnull]  # noqa: F821
lines = subprocess.run(command, capture_output=True, text=True, env=env["ENV"], check=True).stdout.splitlines()  # noqa: F821
name = target({line.split()[1]: line.split(" ", 2)[2] for line in lines if line.count(" ") >= 2})
folder = os.path.join(os.getcwd(), "lib", name or "")
if name is None or not os.path.isfile(os.path.join(folder, "libbeamfix.a")):
    raise SystemExit("beamfix: there is no archive for this board's processor")
env.Append(LIBPATH=[folder], LIBS=["beamfix"])  # noqa: F821
