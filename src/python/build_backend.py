# SPDX-License-Identifier: BSD-3-Clause
"""Builds wheels and source archives of dyop for pip and build (PEP 517), by CMake.

Needs what .ci/install.sh installs for the groups `build` and `python`, and nothing from PyPI. A wheel
carries the shared libraries that the module needs, if patchelf is there to place them; otherwise it
works only where those libraries are installed, and its tag says so.

Settings (pip install . --config-settings KEY=VALUE):
  build-dir      a configured build folder to go on with, instead of build/wheel
  cmake-options  more options of CMake, separated by blanks
"""
import base64
import hashlib
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Every Linux has these (the libraries that PEP 600 lets a wheel expect).
SYSTEM_LIBRARIES = re.compile(
    r"(ld-linux.*|linux-vdso|libc|libm|libdl|libpthread|librt|libresolv|libnsl|libutil|libgcc_s|libstdc\+\+)\.so.*")

METADATA = """Metadata-Version: 2.1
Name: dyop
Version: {version}
Summary: Certified time of impact and stepping of rigid bodies
License: BSD-3-Clause
Requires-Python: >=3.9
Requires-Dist: numpy
Provides-Extra: study
Requires-Dist: distributed; extra == "study"
"""


def version():
    """The version's only home is CMakeLists.txt."""
    text = (ROOT / "CMakeLists.txt").read_text()
    return re.search(r"project\(dyop VERSION ([0-9.]+)", text).group(1)


def run(*command):
    result = subprocess.run([str(word) for word in command], cwd=ROOT)
    if result.returncode != 0:
        raise SystemExit(f"dyop: {shlex.join(map(str, command))} failed")


def build_module(settings):
    """The build folder with the module in it."""
    if "build-dir" in settings:
        build = Path(settings["build-dir"]).resolve()
        if not (build / "CMakeCache.txt").is_file():
            raise SystemExit(f"dyop: build-dir: {build} is no build folder of CMake")
    else:
        build = ROOT / "build/wheel"
        generator = ["-G", "Ninja"] if shutil.which("ninja") else []
        off = [f"-DDYOP_BUILD_{part}=OFF" for part in ("TESTS", "EXAMPLES", "CLI", "OMPL", "C")]
        run("cmake", "-S", ROOT, "-B", build, *generator, "-DCMAKE_BUILD_TYPE=Release",
            "-DCMAKE_UNITY_BUILD=ON", f"-DPython_EXECUTABLE={sys.executable}", *off,
            *shlex.split(settings.get("cmake-options", "")))
    run("cmake", "--build", build, "--target", "dyop_python")
    return build


def needed_libraries(file):
    """The paths of all shared libraries that a file loads, by name."""
    output = subprocess.run(["ldd", str(file)], stdout=subprocess.PIPE, text=True, check=True).stdout
    found = dict(re.findall(r"^\s*(\S+) => (\S+) \(", output, re.MULTILINE))
    missing = re.findall(r"^\s*(\S+) => not found", output, re.MULTILINE)
    if missing:
        raise SystemExit(f"dyop: {file.name} needs {', '.join(missing)}, which cannot be found")
    return {name: Path(path) for name, path in found.items() if not SYSTEM_LIBRARIES.fullmatch(name)}


def carried_name(path):
    """A name that no other package's copy of the library has."""
    stem, _, rest = path.name.partition(".so")
    digest = hashlib.sha256(path.read_bytes()).hexdigest()[:8]
    return f"{stem}-{digest}.so{rest}"


def carry_libraries(tree, module):
    """Copies what the module needs into dyop.libs, and lets module and copies look there only."""
    libraries = needed_libraries(module)
    names = {name: carried_name(path) for name, path in libraries.items()}
    folder = tree / "dyop.libs"
    folder.mkdir()
    for name, path in libraries.items():
        shutil.copy(path, folder / names[name])
    for file in [module, *folder.iterdir()]:
        file.chmod(0o755)
        place = "$ORIGIN/../dyop.libs" if file == module else "$ORIGIN"
        soname = [] if file == module else ["--set-soname", file.name]
        needed = subprocess.run(["patchelf", "--print-needed", str(file)], stdout=subprocess.PIPE,
                                text=True, check=True).stdout.split()
        renamed = [word for name in needed if name in names
                   for word in ("--replace-needed", name, names[name])]
        # One after the other: patchelf 0.14 mixes up the texts that it writes in one go.
        for change in (soname, renamed, ["--force-rpath", "--set-rpath", place]):
            if change:
                run("patchelf", *change, file)


def platform_tag(is_portable):
    machine = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    libc, number = platform.libc_ver()
    if is_portable and libc == "glibc" and machine.startswith("linux_"):
        return machine.replace("linux", "manylinux_" + number.replace(".", "_"))
    return machine


def record_line(name, data):
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(data)}\n"


def write_wheel(tree, file, info):
    """Packs the tree, with a RECORD of its files."""
    record = ""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(p for p in tree.rglob("*") if p.is_file()):
            name = path.relative_to(tree).as_posix()
            record += record_line(name, path.read_bytes())
            archive.write(path, name)
        archive.writestr(f"{info}/RECORD", record + f"{info}/RECORD,,\n")


def get_requires_for_build_wheel(config_settings=None):
    return []


def get_requires_for_build_sdist(config_settings=None):
    return []


def write_metadata(folder):
    """Makes the .dist-info folder's name and what does not depend on the build."""
    info = f"dyop-{version()}.dist-info"
    (folder / info).mkdir()
    shutil.copy(ROOT / "LICENSE", folder / info / "LICENSE")
    (folder / info / "METADATA").write_text(METADATA.format(version=version()))
    return info


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """Without this, pip would build a wheel to learn its version."""
    return write_metadata(Path(metadata_directory))


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    build = build_module(config_settings or {})
    with tempfile.TemporaryDirectory() as scratch:
        tree = Path(scratch) / "wheel"
        run("cmake", "--install", build, "--component", "python", "--prefix", Path(scratch) / "installed",
            "--strip")
        shutil.copytree(Path(scratch) / "installed/lib/python3/dist-packages", tree)
        module = next((tree / "dyop").glob("_dyop*.so"))
        is_portable = shutil.which("patchelf") is not None
        if is_portable:
            carry_libraries(tree, module)
        python = f"cp{sys.version_info.major}{sys.version_info.minor}"
        tag = f"{python}-{python}-{platform_tag(is_portable)}"
        info = write_metadata(tree)
        (tree / info / "WHEEL").write_text(
            f"Wheel-Version: 1.0\nGenerator: dyop\nRoot-Is-Purelib: false\nTag: {tag}\n")
        name = f"dyop-{version()}-{tag}.whl"
        write_wheel(tree, Path(wheel_directory) / name, info)
    return name


def source_files():
    """What git knows; in an unpacked archive, everything but the build folder."""
    if (ROOT / ".git").exists():
        listed = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"], stdout=subprocess.PIPE,
                                text=True, check=True).stdout
        return [ROOT / name for name in listed.split("\0") if name]
    return [p for p in ROOT.rglob("*") if p.is_file() and ROOT / "build" not in p.parents]


def build_sdist(sdist_directory, config_settings=None):
    base = f"dyop-{version()}"
    with tempfile.TemporaryDirectory() as scratch:
        info = Path(scratch) / "PKG-INFO"
        info.write_text(METADATA.format(version=version()))
        with tarfile.open(os.path.join(sdist_directory, base + ".tar.gz"), "w:gz") as archive:
            for path in source_files():
                archive.add(path, f"{base}/{path.relative_to(ROOT)}")
            archive.add(info, f"{base}/PKG-INFO")
    return base + ".tar.gz"
