#!/bin/bash
# documents.sh BUILD_DIR WORK_DIR: what is written from the table of options when the program is built. The man page has
# no fault that its formatters know of and names every option and exit code; the completions work in bash and in zsh.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"
documents=$build/colmap_graphmatch/documents
page=$documents/graphmatch_matcher.1

for tool in mandoc groff zsh python3; do
  command -v "$tool" >/dev/null || { echo "$tool is not installed."; exit 77; }
done

faults=$(mandoc -Tlint -Wwarning "$page" 2>&1 || true)
[[ -z $faults ]] || fail "mandoc: $faults"
faults=$(groff -man -ww -Tutf8 "$page" 2>&1 >/dev/null)
[[ -z $faults ]] || fail "groff: $faults"
[[ $(zcat "$page.gz") == "$(<"$page")" ]] || fail "the compressed man page is another one"

# As it is read, without line breaks within names.
MANWIDTH=500 mandoc -Tascii -O width=500 "$page" | col -b >"$work/page.txt"
# shellcheck disable=SC2016  # The backticks are those of the document.
names=$(sed -n -E -e 's/^\| `([^`]+)`.*/\1/p' -e 's/^  `([^`]+)`$/\1/p' "$documents/options.md"
  grep -o -E '[0-9]: `[^`]+`' "$documents/options.md" | sed -E 's/.*`(.*)`/\1/')
count=0
while IFS= read -r name; do
  grep -q -E -- "--${name//./\\.}(\$|[^A-Za-z0-9_.]|\.\$)" "$work/page.txt" || fail "the man page does not name --$name"
  count=$((count + 1))
done < <(sort -u <<<"$names")
((count > 100)) || fail "$count options in the man page"
while IFS= read -r code; do
  sed -n '/^EXIT STATUS/,/^ENVIRONMENT/p' "$work/page.txt" | grep -q -E "^ +$code " || fail "no exit code $code"
done < <(sed -n -E 's/.* = ([0-9]+),.*/\1/p' "$root/colmap_graphmatch/cli/exit_codes.h")
echo "$count names of options in the man page"

bash -n "$documents/graphmatch_matcher.bash"
zsh -n "$documents/_graphmatch_matcher"
python3 "$root/tests/completion_test.py" "$documents" "$work"
