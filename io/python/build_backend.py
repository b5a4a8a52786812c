# SPDX-License-Identifier: BSD-3-Clause
"""Makes wheels of the package carom, for pip (PEP 517), by the CMake of this repository; needs Python alone besides.

A wheel holds the package, its compiled part and the command carom, without MPI. Both contain the libraries that they
use, and need those of glibc alone (CAROM_PORTABLE). CMAKE_ARGS in the environment holds further arguments for CMake; with
"-DCAROM_PORTABLE=OFF" the wheel uses the libraries, and MPI, of the machine that it is built on.

Objects stay in build/pip-… and are used again; ccache shares them with other builds.
"""

import base64
import hashlib
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
GLIBC = {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}
# The Debian packages of the libraries that a wheel contains; those of which it contains headers are in cmake/copyright.
CONTAINED = "libhdf5-dev", "libaec-dev", "zlib1g-dev", "libdeflate-dev", "libstdc++-*-dev"


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    project, version = project_and_version()
    files = {f"carom/{name}": content for name, content in built_package().items()}
    command = build_folder() / "io" / "carom"
    scripts = f"carom-{version}.data/scripts/"
    files[f"{scripts}carom"] = command.read_bytes()
    tag = "cp{0}{1}-cp{0}{1}-{2}".format(*sys.version_info[:2], platform(command, *build_folder().glob("io/python/carom/_carom*.so")))
    files |= about(project, version, tag)
    record = "".join(f"{name},sha256={digest(content)},{len(content)}\n" for name, content in files.items())
    files[f"carom-{version}.dist-info/RECORD"] = (record + f"carom-{version}.dist-info/RECORD,,\n").encode()
    name = f"carom-{version}-{tag}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in files.items():
            entry = zipfile.ZipInfo(path)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o100755 if path.startswith(scripts) else 0o100644) << 16
            wheel.writestr(entry, content)
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("the sources of carom are more than this folder; clone the repository, and pip install ./io/python")


def project_and_version():
    project = tomllib.loads((HERE / "pyproject.toml").read_text())["project"]
    return project, re.search(r"project\(carom VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def platform(*binaries):
    """manylinux, with the oldest glibc on which these run, if they need no other library; else this machine's platform."""
    if sys.platform == "linux":
        needs = subprocess.run(["objdump", "-p", *binaries], capture_output=True, text=True, check=True).stdout
        if set(re.findall(r"NEEDED +(\S+)", needs)) <= GLIBC:
            oldest = max((int(major), int(minor)) for major, minor in re.findall(r"GLIBC_(\d+)\.(\d+)", needs))
            return "manylinux_{}_{}_{}".format(*oldest, os.uname().machine)
    return re.sub(r"\W", "_", sysconfig.get_platform())


def about(project, version, tag):
    """The files of the dist-info but RECORD."""
    info = f"carom-{version}.dist-info"
    files = {f"{info}/METADATA": metadata(project, version).encode(), f"{info}/LICENSE": (ROOT / "LICENSE").read_bytes(),
             f"{info}/licenses/headers": (ROOT / "cmake/copyright").read_bytes(),
             f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: carom\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()}
    if "manylinux" in tag:
        found = [file for name in CONTAINED for file in pathlib.Path("/usr/share/doc").glob(f"{name}/copyright")]
        files |= {f"{info}/licenses/{file.parent.name}": file.read_bytes() for file in found}
    return files


def build_folder():
    return pathlib.Path(os.environ.get("CAROM_PIP_BUILD", ROOT / "build" / f"pip-{sys.implementation.cache_tag}"))


def built_package():
    """The files of the package by name, compiled for this Python."""
    folder = build_folder()
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    run("cmake", "-S", ROOT, "-B", folder, *(generator if not (folder / "CMakeCache.txt").exists() else []),
        "-DCMAKE_BUILD_TYPE=Release", "-DCAROM_BUILD_TESTS=OFF", "-DCAROM_UNITY=ON", "-DCAROM_PORTABLE=ON", f"-DPython3_EXECUTABLE={sys.executable}",
        *shlex.split(os.environ.get("CMAKE_ARGS", "")))
    run("cmake", "--build", folder, "--parallel", str(len(os.sched_getaffinity(0))), "--target", "carom_python", "carom")
    with tempfile.TemporaryDirectory() as staged:
        run("cmake", "--install", folder, "--prefix", staged, "--component", "python")
        package, = pathlib.Path(staged).glob("lib/python3*/*-packages/carom")
        return {file.name: file.read_bytes() for file in sorted(package.iterdir())}


def metadata(project, version):
    lines = ["Metadata-Version: 2.1", f"Name: {project['name']}", f"Version: {version}", f"Summary: {project['description']}",
             f"License: {project['license']['text']}", f"Requires-Python: {project['requires-python']}"]
    lines += [f"Requires-Dist: {name}" for name in project["dependencies"]]
    for extra, names in project["optional-dependencies"].items():
        lines += [f"Provides-Extra: {extra}"] + [f"Requires-Dist: {name}; extra == '{extra}'" for name in names]
    return "\n".join(lines) + "\nDescription-Content-Type: text/markdown\n\n" + (HERE / project["readme"]).read_text()


def digest(content):
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()


def run(*command):
    done = subprocess.run([str(part) for part in command])
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))} failed; tools/build-packages.txt and "
                         "tools/wheel-packages.txt list the Debian packages that the build needs")
