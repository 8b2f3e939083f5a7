#!/bin/bash
# Run as root in a bare root of Debian bookworm, with /trial from scripts/package --test: installs the package with
# what it depends on, tries it as a user, removes it, and looks for anything left behind.
set -euo pipefail

fail() {
  echo "FAILED: $*" >&2
  exit 1
}

# Every path but those of the kernel and of this test.
list_files() {
  find / \( -path /proc -o -path /sys -o -path /dev -o -path /trial -o -path /var/cache/apt \) -prune -o -print |
    LC_ALL=C sort
}

export DEBIAN_FRONTEND=noninteractive
# No services in here.
printf '#!/bin/sh\nexit 101\n' >/usr/sbin/policy-rc.d
chmod +x /usr/sbin/policy-rc.d
[[ -z $(list_files | grep graphmatch || true) ]] || fail "the root is not bare"

echo "Installing the package and what it depends on ..."
apt-get update -qq
apt-get install --yes --no-install-recommends /trial/colmap-graphmatch.deb >/trial/apt.log 2>&1 ||
  { tail -n 20 /trial/apt.log; fail "apt-get install"; }
dpkg-query --show --showformat='${Package} ${Version}: ${db:Status-Status}\n' colmap-graphmatch colmap
dpkg --verify colmap-graphmatch || fail "dpkg --verify"

useradd --no-create-home --home-dir /trial/home photographer
mkdir /trial/home
chown -R photographer: /trial
setpriv --reuid photographer --regid photographer --init-groups env HOME=/trial/home bash /trial/user.sh
userdel photographer

echo "Removing the package ..."
dpkg-query --listfiles colmap-graphmatch | LC_ALL=C sort >/trial/files.txt
list_files >/trial/with.txt
apt-get remove --yes --purge colmap-graphmatch >>/trial/apt.log 2>&1 ||
  { tail -n 20 /trial/apt.log; fail "apt-get remove"; }
list_files >/trial/without.txt
# All that was removed is the package's, and dpkg's notes on it.
comm -23 /trial/with.txt /trial/without.txt >/trial/removed.txt
strange=$(comm -23 /trial/removed.txt /trial/files.txt | grep -v '^/var/lib/dpkg/info/colmap-graphmatch\.' || true)
[[ -z $strange ]] || fail "removed, too: $strange"
while IFS= read -r file; do
  [[ -d $file || ! -e $file ]] || fail "left behind: $file"
done </trial/files.txt
left=$(grep graphmatch /trial/without.txt || true)
[[ -z $left ]] || fail "left behind: $left"
echo "$(wc -l </trial/removed.txt) paths removed, nothing left behind."
