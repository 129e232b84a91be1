# Sourced by ./demo and ./test: what both need before they can run anything.
# shellcheck shell=bash

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

say() { printf '\033[1m==>\033[0m %s\n' "$*" >&2; }
die() {
  printf '%s\n' "$*" >&2
  exit 4
}

# Names from apt-packages.txt that dpkg does not know as installed.
missing_packages() {
  local wanted installed
  wanted=$(sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' "$root/apt-packages.txt")
  installed=$(dpkg-query --show --showformat='${db:Status-Status} ${Package}\n' 2>/dev/null | sed -n 's/^installed //p')
  comm -23 <(sort -u <<<"$wanted") <(sort -u <<<"$installed")
}

# Installs the given packages, as root or with sudo, and says so.
install_packages() {
  local as_root=()
  if [[ $(id -u) -ne 0 ]]; then
    command -v sudo >/dev/null || die "These packages are missing: $*
Neither root nor sudo is at hand. As root, run: apt-get update && apt-get install --no-install-recommends $*"
    as_root=(sudo)
    say "Installing $# packages with sudo (it may ask for your password): $*"
  else
    say "Installing $# packages: $*"
  fi
  "${as_root[@]}" apt-get update -qq ||
    say "apt-get update failed; trying with the package lists that are there"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq -o Dpkg::Use-Pty=0 --no-install-recommends "$@" >&2 ||
    die "apt-get could not install the packages above. ./$(basename "$0") needs them; see its messages."
}

# Everything a build needs, and Node for the web page; nothing happens where all of it is there.
ensure_tools() {
  if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    say "No apt-get here: expecting the equivalents of apt-packages.txt to be installed"
    return
  fi
  local missing=()
  mapfile -t missing < <(missing_packages)
  if [[ -f $root/web/package.json ]]; then
    command -v node >/dev/null || missing+=(nodejs)
    command -v npm >/dev/null || missing+=(npm)
  fi
  if [[ ${#missing[@]} -gt 0 ]]; then install_packages "${missing[@]}"; fi
}

# As many compilers as there are processors, but not more than memory holds: one takes up to about 1.2 GB.
jobs() {
  local processors memory_kb
  processors=$(nproc 2>/dev/null || echo 2)
  memory_kb=$(awk '/^MemAvailable:/ {print $2}' /proc/meminfo 2>/dev/null || echo 4000000)
  local fitting=$((memory_kb / 1200000))
  ((fitting < 1)) && fitting=1
  echo $((processors < fitting ? processors : fitting))
}

# build PRESET [TARGET…]: configures once, then builds.
build() {
  local preset=$1
  shift
  local generator=()
  if [[ ! -f $root/build/$preset/CMakeCache.txt ]] && command -v ninja >/dev/null; then generator=(-G Ninja); fi
  if [[ ! -f $root/build/$preset/build.ninja && ! -f $root/build/$preset/Makefile ]]; then
    say "Configuring build/$preset"
    (cd "$root" && cmake --preset "$preset" "${generator[@]}" >&2)
  fi
  local targets=()
  if [[ $# -gt 0 ]]; then targets=(--target "$@"); fi
  say "Building build/$preset"
  (cd "$root" && cmake --build --preset "$preset" --parallel "$(jobs)" "${targets[@]}" >&2)
}
