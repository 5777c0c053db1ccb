#!/usr/bin/env python3
"""The same bits on every machine: digests of episodes against those of web/bits.txt.

    python3 web/test_bits.py [--episodes N] [--write]

Runs the program `bits` on this machine, the live page's module under node, and the program for aarch64 under qemu, as far as they are
installed, and says what it skipped. A line of the file has a digest of 10 episodes and, except for jerk-limited set-points, one of 200. N is 10
or 200 (10 by default; under qemu always 10: it takes minutes). `--write` writes the file anew with this machine's digests.
"""

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
FILE = HERE / "bits.txt"
TARGET = HERE.parent / "target/web"
FIRST, ALL = 10, 200
CARGO = os.environ.get("CARGO", "cargo")


def build(*arguments):
    subprocess.run([CARGO, "build", "--release", "--quiet", "--target-dir", TARGET, *arguments], cwd=HERE, check=True)


def has_target(name):
    """Whether Rust's library for a target is installed."""
    answer = subprocess.run(["rustc", "--print", "target-libdir", "--target", name], cwd=HERE, capture_output=True, text=True)
    return answer.returncode == 0 and Path(answer.stdout.strip()).is_dir()


def native(episodes):
    build("--bin", "bits")
    return [TARGET / "release/bits", str(episodes)]


def wasm(episodes):
    target = "wasm32-unknown-unknown"
    if not shutil.which("node"):
        return "node is not installed"
    if not has_target(target):
        return f"rustup target add {target}"
    build("--lib", "--target", target)
    return ["node", HERE / "bits.mjs", TARGET / target / "release/live.wasm", str(episodes)]


def aarch64(_):
    target = "aarch64-unknown-linux-musl"
    emulator = shutil.which("qemu-aarch64") or shutil.which("qemu-aarch64-static")
    if not emulator:
        return "qemu-aarch64 is not installed (Debian: qemu-user)"
    if not has_target(target):
        return f"rustup target add {target}"
    build("--bin", "bits", "--target", target)
    return [emulator, TARGET / target / "release/bits", str(FIRST)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--episodes", type=int, choices=[FIRST, ALL], default=FIRST)
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    if asked.write:
        lines = subprocess.run(native(ALL), check=True, stdout=subprocess.PIPE, text=True).stdout
        FILE.write_text(lines)
    expected = [line.split() for line in FILE.read_text().splitlines()]
    failed = False
    for name, way in [(os.uname().machine, native), ("wasm32 under node", wasm), ("aarch64 under qemu", aarch64)]:
        command = way(asked.episodes)
        if isinstance(command, str):
            print(f"{name}: skipped: {command}")
            continue
        found = [line.split() for line in subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()]
        if [line[:2] for line in found] != [line[:2] for line in expected]:
            sys.exit(f"{name}: other tasks and spaces than in {FILE.name}: make it again with --write")
        differ = [" ".join(line[:2]) for line, other in zip(found, expected) if any(a != b for a, b in zip(line, other))]
        print(f"{name}: {len(found) - len(differ)} of {len(found)} lines have the bits of {FILE.name}" + "".join(f"\n  {line} differs" for line in differ))
        # Jerk-limited set-points may differ: their generator takes atan2 from the platform's C library.
        failed |= any("jerk-limited" not in line for line in differ)
    sys.exit(failed)


main()
