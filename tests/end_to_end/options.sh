#!/bin/bash
# options.sh BUILD_DIR WORK_DIR [COLMAP]: the table of options is that of the installed COLMAP, or of another one, and
# docs/options.md is what the table says.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"
colmap=${3:-colmap}

written=$build/colmap_graphmatch/documents/options.md
diff "$root/docs/options.md" "$written" || fail "docs/options.md is not up to date: cp $written docs/options.md"

command -v "$colmap" >/dev/null || { echo "COLMAP is not installed."; exit 77; }
banner=$("$colmap" help)
version=$(sed -n -E 's/^COLMAP ([0-9]+\.[0-9]+).*/\1/p' <<<"$banner")
"$colmap" vocab_tree_matcher -h >"$work/help.txt" 2>&1
"$build/tests/option_table" "$version" <"$work/help.txt"

# The table is not only looked at: all that this COLMAP has is accepted, with its default, by the program.
"$build/tests/make_synthetic_database" "$work/database.db" 2 5
arguments=()
while read -r name value; do
  # A model's path and the like have no default.
  [[ -n $value ]] || continue
  if [[ $name == *.use_gpu ]]; then value=0; fi
  arguments+=("--$name" "$value")
done < <(sed -n -E 's/^ +--([A-Za-z0-9_]+\.[A-Za-z0-9_]+) arg \(=([^)]*)\).*/\1 \2/p' "$work/help.txt")
((${#arguments[@]} >= 40)) || fail "few options: ${arguments[*]}"
expect_exit 0 'Pairs tested' "$matcher" --database_path "$work/database.db" --colmap_path "$colmap" "${arguments[@]}"
if grep 'does not have these options' "$work/output.txt"; then fail "an option did not reach COLMAP"; fi
echo "$((${#arguments[@]} / 2)) options of COLMAP $version accepted"
