#!/bin/bash
# package.sh BUILD_DIR WORK_DIR: the Debian package of a build: what is in it, what it says of itself, and lintian's
# opinion. (scripts/package --test installs one.)
# shellcheck source-path=SCRIPTDIR/../end_to_end
source "$(dirname "$0")/../end_to_end/common.sh"

command -v dpkg-shlibdeps >/dev/null || { echo "dpkg-dev is not installed."; exit 77; }
(cd "$build" && cpack -G DEB -B "$work/cpack") >"$work/cpack.log" 2>&1 || { cat "$work/cpack.log"; fail cpack; }
packages=("$work"/cpack/*.deb)
((${#packages[@]} == 1)) || fail "${#packages[@]} packages"
package=${packages[0]}
version=$("$matcher" --version | sed -E 's/.* //')
architecture=$(dpkg --print-architecture)
[[ ${package##*/} == "colmap-graphmatch_$version-1_$architecture.deb" ]] || fail "a package called ${package##*/}"

dpkg-deb --contents "$package" >"$work/contents.txt"
# expect_file MODE PATH: it is in the package, root's, and not empty.
expect_file() {
  grep -q -E "^$1 root/root +[1-9][0-9]* [^ ]+ [^ ]+ \./usr/${2//./\\.}\$" "$work/contents.txt" ||
    { cat "$work/contents.txt"; fail "no $1 /usr/$2"; }
}
expect_file -rwxr-xr-x bin/graphmatch_matcher
expect_file -rwxr-xr-x libexec/colmap-graphmatch/colmap
expect_file -rw-r--r-- share/man/man1/graphmatch_matcher.1.gz
expect_file -rw-r--r-- share/bash-completion/completions/graphmatch_matcher
expect_file -rw-r--r-- share/zsh/vendor-completions/_graphmatch_matcher
for file in README.md copyright changelog.gz changelog.Debian.gz docs/options.md docs/install.md; do
  expect_file -rw-r--r-- "share/doc/colmap-graphmatch/$file"
done
# Nothing of the components for developers, and nothing that only root could read.
unwanted=$(grep -E '/include/|\.a$|\.cmake$|/local/| [^ ]*/(test|fake)_' "$work/contents.txt" || true)
[[ -z $unwanted ]] || fail "in the package, too: $unwanted"
if grep -v -E '^(drwxr-xr-x|-rwxr-xr-x|-rw-r--r--) root/root ' "$work/contents.txt"; then fail "wrong permissions"; fi

dpkg-deb --extract "$package" "$work/unpacked"
[[ $(file -b "$work/unpacked/usr/bin/graphmatch_matcher") == *', stripped'* ]] || fail "the program is not stripped"
[[ $("$work/unpacked/usr/bin/graphmatch_matcher" --version) == "graphmatch_matcher $version" ]] || fail "another version"
if readelf --dynamic "$work/unpacked/usr/bin/graphmatch_matcher" | grep -E 'RPATH|RUNPATH'; then
  fail "the program looks for libraries where it was built"
fi
depends=$(dpkg-deb --field "$package" Depends)
for dependency in 'colmap (>= 3.8)' libopencv-core libsqlite3-0 libhwy; do
  [[ $depends == *"$dependency"* ]] || fail "depends on $depends"
done
[[ $(dpkg-deb --field "$package" Section Priority | sort | tr '\n' ' ') == 'Priority: optional Section: science ' ]] ||
  fail "section or priority"

# The program picks its instructions when it runs: none may be compiled in for this machine alone.
commands=$build/compile_commands.json
grep -q main.cc "$commands" || fail "no commands in $commands"
if grep -o -E -e ' -m(arch|cpu|tune)=[^ ]*| -mavx[^ ]*' "$commands"; then fail "the build is for this machine alone"; fi

if ! command -v lintian >/dev/null; then
  echo "lintian is not installed: not asked."
  exit 0
fi
lintian --allow-root --fail-on error "$package" || fail lintian
