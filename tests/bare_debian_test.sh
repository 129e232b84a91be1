#!/usr/bin/env bash
# The packages on a Debian 12 that has nothing else: installed with apt, run, compiled against, purged.
# usage: bare_debian_test.sh SOURCE_DIR PACKAGES_DIR WORK_DIR
# The bare system is made once by debootstrap and kept in WORK_DIR/bookworm.tar.
set -euo pipefail
source=$1 packages=$2 work=$3
skip() { echo "skipped: $*" && exit 77; }
[[ $(id -u) -eq 0 ]] || skip "a chroot needs root"
command -v debootstrap >/dev/null || skip "there is no debootstrap (apt-get install debootstrap)"
unshare --mount true 2>/dev/null || skip "no mount namespaces here"
compgen -G "$packages/sentree_*.deb" >/dev/null || skip "no packages in $packages: package.debian makes them"
mirror=${SENTREE_DEBIAN_MIRROR:-http://deb.debian.org/debian}
mkdir -p "$work"
if [[ ! -s $work/bookworm.tar ]]; then
  rm -rf "$work/base"
  timeout 500 debootstrap --variant=minbase bookworm "$work/base" "$mirror" >"$work/debootstrap.log" 2>&1 </dev/null ||
    { tail -n 3 "$work/debootstrap.log" && skip "debootstrap failed: no network?"; }
  tar -cf "$work/bookworm.part" -C "$work/base" . && mv "$work/bookworm.part" "$work/bookworm.tar"
  rm -rf "$work/base"
fi

export work packages source
# Mounts go with the namespace, however the test ends.
status=0
unshare --mount --fork bash -euo pipefail <<'END' || status=$?
root=$work/root
rm -rf "$root" && mkdir -p "$root" && tar -xf "$work/bookworm.tar" -C "$root"
mount --make-rprivate /
mount -t tmpfs tmpfs "$root/tmp" && mount -t proc proc "$root/proc" && mount --rbind /dev "$root/dev"
cp /etc/resolv.conf "$root/etc/" && cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/"
cp "$packages"/*.deb "$root/tmp/"
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@" </dev/null; }
inside apt-get update -qq || { echo "skipped: apt-get update failed: no network?"; exit 77; }
# What is there, but for what apt and dpkg themselves keep.
files() { (cd "$root" && find . -xdev \( -path ./tmp -o -path ./proc -o -path ./dev -o -path ./var/cache -o -path ./var/lib/apt -o -path ./var/lib/dpkg -o -path ./var/log \) -prune -o -print | sort); }
inside dpkg-query -W -f '${Package}\n' | sort >"$work/packages-before"
files >"$work/files-before"

inside apt-get install -y -qq --no-install-recommends $(cd "$packages" && printf '/tmp/%s ' sentree_*.deb) >"$work/install.log" 2>&1 ||
  { tail -n 5 "$work/install.log"; exit 1; }
if inside sh -c 'command -v cc c++ gcc clang'; then echo "✗ a compiler was installed"; exit 1; fi
inside sentree --version
inside sh -c 'cd /usr/share/sentree && sentree test examples/recharge'
inside sh -c 'cd /tmp && sentree init mine && sentree test mine && sentree doctor'
inside sh -c 'cd /tmp && sentree run /usr/share/sentree/examples/recharge --scenario recharge --clock virtual --record run.mcap && sentree bug-report run.mcap -o report.tar.gz && tar -tzf report.tar.gz'
# The page is in the program: a recording's is served.
inside sh -c 'cd /tmp && { sentree studio run.mcap --at 4799 >page.log 2>&1 & page=$!; for try in $(seq 200); do grep -q http page.log && break; read -t 0.1 </dev/zero 2>/dev/null || true; done; kill $page; wait $page || true; cat page.log; grep -q "http://127.0.0.1:4799" page.log; }'

inside apt-get purge -y -qq --autoremove sentree >"$work/purge.log" 2>&1 || { tail -n 5 "$work/purge.log"; exit 1; }
inside dpkg-query -W -f '${Package}\n' | sort >"$work/packages-after"
files >"$work/files-after"
diff "$work/packages-before" "$work/packages-after" || { echo "✗ purge left packages"; exit 1; }
# What programs with triggers of other packages write belongs to those.
diff "$work/files-before" "$work/files-after" || { echo "✗ purge left files"; exit 1; }
END
rm -rf "$work/root"
[[ $status -eq 0 ]] && echo "all good"
exit "$status"
