#!/usr/bin/env bash
# The packages of scripts/package: what they hold, what they depend on, and that what is in them runs.
# usage: package_test.sh SOURCE_DIR WORK_DIR
set -euo pipefail
source=$1 work=$2
for tool in dpkg-deb dpkg-shlibdeps cpack file patchelf zstd gzip; do
  command -v "$tool" >/dev/null || { echo "skipped: there is no $tool (scripts/package installs it)" && exit 77; }
done
rm -rf "$work" && mkdir -p "$work"
fail() { echo "✗ $*" && exit 1; }

"$source/scripts/package" --no-build --no-lintian --out "$work/out" </dev/null
version=$(sed -n 's/^project(Sentree VERSION \([0-9.]*\).*/\1/p' "$source/CMakeLists.txt")
program=$(echo "$work"/out/sentree_"$version"_*.deb) development=$(echo "$work"/out/libsentree-dev_"$version"_*.deb)
archive=$(echo "$work"/out/sentree-"$version"-linux-*.tar.zst)

depends=$(dpkg-deb --field "$program" Depends)
for wanted in libc6 libstdc++6 libthrift- libduktape libyaml-cpp; do
  [[ $depends == *$wanted* ]] || fail "sentree does not depend on $wanted: $depends"
done
[[ $depends != *-dev* ]] || fail "sentree depends on what only compilers need: $depends"
depends=$(dpkg-deb --field "$development" Depends)
for wanted in libexpected-dev libthrift-dev libssl-dev; do
  [[ $depends == *$wanted* ]] || fail "libsentree-dev does not depend on $wanted: $depends"
done

# DDS comes with a package of its own, which nobody needs who has no ROS.
[[ $(dpkg-deb --field "$program" Depends) != *fastrtps* ]] || fail "sentree depends on DDS"
if [[ -e $source/build/release/lib/sentree/libsentree_dds.so ]]; then
  ros=$(echo "$work"/out/sentree-ros_"$version"_*.deb)
  [[ $(dpkg-deb --field "$ros" Depends) == *libfastrtps* ]] || fail "sentree-ros does not depend on DDS"
  dpkg-deb --extract "$ros" "$work/ros"
  [[ -s $work/ros/usr/lib/sentree/libsentree_dds.so ]] || fail "sentree-ros lacks its library"
fi
dpkg-deb --extract "$program" "$work/program"
dpkg-deb --extract "$development" "$work/development"
for file in usr/bin/sentree usr/share/man/man1/sentree.1.gz usr/share/man/man1/sentree-run.1.gz usr/share/applications/sentree.desktop \
  usr/share/mime/packages/sentree.xml usr/share/bash-completion/completions/sentree usr/share/zsh/vendor-completions/_sentree \
  usr/share/fish/vendor_completions.d/sentree.fish usr/share/sentree/interfaces/robot.thrift usr/share/sentree/skills/nav2/FollowPath.scxml usr/share/sentree/examples/recharge/sentree.yaml \
  usr/share/doc/sentree/copyright; do
  [[ -s $work/program/$file ]] || fail "sentree lacks /$file"
done
compgen -G "$work/development/usr/lib*/libsentree_bt.a" >/dev/null || fail "libsentree-dev lacks sentree::bt"
[[ -s $work/development/usr/include/sentree/bt/tree.h ]] || fail "libsentree-dev lacks headers"
named=$(grep -rlF "$source" "$work/program" "$work/development/usr/lib/cmake" || true)
[[ -z $named ]] || fail "these name the folder of their sources: $named"
# A compiler's cache may have made such names relative.
named=$(grep -aoE '[./]*/src/[a-z_]+/[a-z_]+\.(cpp|h)\b' "$work/program/usr/bin/sentree" | sort -u || true)
[[ -z $named ]] || fail "the program names its sources: $named"

# man finds nothing to complain about.
if command -v man >/dev/null; then
  for page in "$work"/program/usr/share/man/man1/*.gz; do
    said=$(LC_ALL=C.UTF-8 MANROFFSEQ='' MANWIDTH=100 man --warnings -E UTF-8 -l -Tutf8 -Z "$page" 2>&1 >/dev/null) || fail "man: $said"
    [[ -z $said ]] || fail "man: $said"
  done
fi
desktop=$work/program/usr/share/applications/sentree.desktop
if command -v desktop-file-validate >/dev/null; then desktop-file-validate "$desktop" || fail "the desktop entry is invalid"; fi

# What was unpacked runs where it lies, and the archive finds its libraries beside itself.
export XDG_RUNTIME_DIR=$work SENTREE_RUNS='' XDG_DATA_DIRS=/nowhere
"$work/program/usr/bin/sentree" --version | grep -q "^sentree $version$" || fail "the program does not say its version"
tar --zstd -xf "$archive" -C "$work"
unpacked=$work/$(basename "$archive" .tar.zst)
outside=$(ldd "$unpacked/bin/sentree" | awk '$3 ~ "^/" {print $3}' | grep -v "^$unpacked/" | xargs -rn1 basename |
  grep -Ev '^(libc|libm|libresolv|libpthread|librt|libdl|libgcc_s|libstdc\+\+)\.so\.[0-9]+$' || true)
[[ -z $outside ]] || fail "the archive leans on $outside"
(cd "$unpacked/share/sentree" && "$unpacked/bin/sentree" test examples/recharge </dev/null) || fail "the archive's example does not hold"
# What it finds wrong with this machine is not the archive's fault.
said=$("$unpacked/bin/sentree" doctor --json || true)
[[ $said == *"$unpacked/share/sentree/interfaces"* ]] || fail "the archive uses others' interfaces"
[[ ! -e $unpacked/lib/sentree/libsentree_dds.so || $said == *'ROS 2 by Fast DDS'* ]] || fail "the archive does not load its DDS"
echo "all good"
