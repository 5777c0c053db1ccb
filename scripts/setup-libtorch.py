#!/usr/bin/env python3
"""Put libtorch (headers and CPU libraries, 0.5 GB) into third_party/libtorch and tell cargo that it is there.

    python3 scripts/setup-libtorch.py

Needs Python 3.8 or newer with pip, on x86_64 Linux; torch itself is not installed and the Python version does not matter. The wheels are
downloaded by pip, which checks their sha256 (libtorch-requirements.txt). A second run changes nothing.
A libtorch of your own is used instead, and only checked here, if LIBTORCH=<folder> or LIBTORCH_USE_PYTORCH=1 is set.
"""

import os
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parent.parent
TARGET = ROOT / "third_party" / "libtorch"
REQUIREMENTS = Path(__file__).with_name("libtorch-requirements.txt")
FREE_BYTES_NEEDED = 1_700_000_000  # pip's temporary copy and the wheel, then the wheel and the unpacked files

# Any CPython build of the wheel holds the same libraries: one is pinned, so that one hash serves every user.
WHEEL_TAGS = ["--only-binary=:all:", "--implementation=cp", "--python-version=311", "--abi=cp311"]
WHEEL_TAGS += [f"--platform={tag}_x86_64" for tag in ("manylinux_2_28", "manylinux_2_25", "manylinux_2_17", "manylinux2014")]

# All libraries lie in one folder: libtorch_cpu.so looks for the others beside itself ($ORIGIN).
LIBRARIES = {"libtorch_cpu.so", "libc10.so", "libgomp.so.1", "libcupti.so.13", "libcudart.so.13"}
LICENSES = {"LICENSE", "NOTICE", "License.txt"}
# The wheel's own libtorch.so pulls in CUDA and is left out; `-ltorch` and `-lgomp` must still find something to link.
LINKS = {"libtorch.so": "libtorch_cpu.so", "libgomp.so": "libgomp.so.1"}
# Included by .cargo/config.toml; relative to the repository.
CARGO_CONFIG = '[env]\nLIBTORCH = { value = "third_party/libtorch", relative = true }\n'


def fail(message):
    sys.exit(f"setup-libtorch: {message}")


def pinned_version():
    line = next(line for line in REQUIREMENTS.read_text().splitlines() if line.startswith("torch=="))
    return line.split()[0].partition("==")[2]


def version_of(folder):
    """Version of the libtorch in `folder`, or None if it is absent or incomplete."""
    version = folder / "build-version"
    present = all(path.exists() for path in (folder / "lib" / "libtorch_cpu.so", folder / "include" / "torch", version))
    return version.read_text().strip().partition("+")[0] if present else None


def check_own_libtorch(version):
    """True if the user chose a libtorch of their own and it is the right one."""
    if "LIBTORCH_USE_PYTORCH" in os.environ:
        python = "python" if "VIRTUAL_ENV" in os.environ else "python3"  # the one torch-sys asks
        run = subprocess.run([python, "-c", "import torch; print(torch.__version__)"], capture_output=True, text=True)
        found = run.stdout.strip().partition("+")[0]
        if found != version:
            fail(f"LIBTORCH_USE_PYTORCH is set, and `{python}` has torch {found or '(none)'}; {version} is needed")
        print(f"setup-libtorch: using torch {found} of `{python}`")
        return True
    folder = os.environ.get("LIBTORCH")
    if folder and Path(folder).resolve() != TARGET:
        found = version_of(Path(folder))
        if found != version:
            fail(f"LIBTORCH={folder} holds libtorch {found or '(none)'}; {version} is needed (unset LIBTORCH to have it downloaded)")
        print(f"setup-libtorch: using libtorch {found} in {folder}")
        return True
    return False


def glibc():
    """Version of this system's glibc, or None where the C library is another one, such as musl."""
    try:
        name, _, version = os.confstr("CS_GNU_LIBC_VERSION").partition(" ")
        return tuple(int(part) for part in version.split(".")[:2]) if name == "glibc" else None
    except (AttributeError, OSError, ValueError):
        return None


def check_machine():
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        fail(f"no wheel is pinned for {platform.system()} {platform.machine()}: set LIBTORCH to a libtorch of your own (see README)")
    found, needed = glibc(), (2, 28)
    if found is None:
        fail("libtorch is linked with glibc, and this system's C library is another (musl, as on Alpine?): nothing was downloaded. "
             "Use a distribution with glibc 2.28 or later, such as Debian 10 or Ubuntu 20.04")
    if found < needed:
        fail(f"libtorch needs glibc 2.28 or later, and this system has {found[0]}.{found[1]}: nothing was downloaded")
    if subprocess.run([sys.executable, "-m", "pip", "--version"], capture_output=True).returncode:
        fail(f"{sys.executable} has no pip: install it (Debian, Ubuntu: apt install python3-pip) or use a virtual environment's python")
    free = shutil.disk_usage(TARGET.parent).free
    if free < FREE_BYTES_NEEDED:
        fail(f"{TARGET.parent} has {free / 1e9:.1f} GB free; {FREE_BYTES_NEEDED / 1e9:.1f} GB are needed while unpacking, 0.5 GB afterwards")


def download(wheels):
    pip = [sys.executable, "-m", "pip", "download", "--no-deps", "--no-cache-dir", "--require-hashes", "--disable-pip-version-check"]
    pip += [*WHEEL_TAGS, "--dest", str(wheels), "--requirement", str(REQUIREMENTS)]
    # pip's temporary files stay on this disk too: /tmp is often small.
    if subprocess.run(pip, env={**os.environ, "TMPDIR": str(wheels.parent)}).returncode:
        fail("the download failed (pip's message is above): is there a network, and do the sha256 sums agree? Nothing was changed")


def destination(member, wheel):
    """Where a wheel's member goes below libtorch/, or None if it is not needed."""
    path = PurePosixPath(member)
    if path.name in LIBRARIES and path.parent.name == "lib":
        return Path("lib", path.name)
    if path.parts[:2] == ("torch", "include"):
        return Path(*path.parts[1:])
    if path.name in LICENSES and ".dist-info" in path.parts[0]:
        return Path("licenses", wheel.name.partition("-")[0], path.name)
    return None


def unpack(wheel, folder):
    with zipfile.ZipFile(wheel) as archive:
        for member in archive.infolist():
            to = None if member.is_dir() else destination(member.filename, wheel)
            if to is not None:
                (folder / to).parent.mkdir(parents=True, exist_ok=True)
                with archive.open(member) as source, open(folder / to, "wb") as out:
                    shutil.copyfileobj(source, out, 1 << 20)


def install(version):
    # Beside the target, so that the final rename is one atomic step; removed whatever happens.
    with tempfile.TemporaryDirectory(prefix=".libtorch-", dir=TARGET.parent) as temporary:
        wheels, folder = Path(temporary, "wheels"), Path(temporary, "libtorch")
        wheels.mkdir()
        print(f"setup-libtorch: downloading libtorch {version} (about 545 MB)", flush=True)
        download(wheels)
        for wheel in sorted(wheels.iterdir()):
            unpack(wheel, folder)
            wheel.unlink()
        missing = LIBRARIES - {path.name for path in (folder / "lib").iterdir()}
        if missing:
            fail(f"the wheels lack {', '.join(sorted(missing))}")
        for name, to in LINKS.items():
            (folder / "lib" / name).symlink_to(to)
        (folder / "cargo.toml").write_text(CARGO_CONFIG)
        (folder / "build-version").write_text(f"{version}+cpu\n")  # read by torch-sys and by version_of
        if TARGET.exists():  # another version, or a damaged folder
            TARGET.rename(Path(temporary, "old"))
        folder.rename(TARGET)
    print(f"setup-libtorch: libtorch {version} is in {TARGET.relative_to(ROOT)}")


def main():
    version = pinned_version()
    if check_own_libtorch(version):
        return
    if version_of(TARGET) == version and (TARGET / "cargo.toml").exists():
        print(f"setup-libtorch: libtorch {version} is already in {TARGET.relative_to(ROOT)}")
        return
    TARGET.parent.mkdir(exist_ok=True)
    for leftover in TARGET.parent.glob(".libtorch-*"):  # of a run that was killed
        shutil.rmtree(leftover)
    check_machine()
    install(version)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        fail("interrupted; nothing was changed")
