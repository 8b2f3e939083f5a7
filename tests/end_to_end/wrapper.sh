#!/bin/bash
# wrapper.sh BUILD_DIR WORK_DIR: scripts/colmap, for programs that call `colmap` by name: what it hands on, to which
# program, and that it never calls itself.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"

# fake FILE NAME [LINE]...: a program that prints its name and its arguments, one a line, and then does the lines.
fake() {
  mkdir -p "$(dirname "$1")"
  { printf '#!/bin/bash\nprintf "%%s\\n" "%s" "$@"\n' "$2"; printf '%s\n' "${@:3}"; } >"$1"
  chmod +x "$1"
}

# expect_lines LINE...: all that the last command printed.
expect_lines() { diff <(printf '%s\n' "$@") "$work/output.txt" || fail "left: what was expected"; }

# shellcheck disable=SC2016  # The variables are the fake programs'.
{
  fake "$work/real/colmap" 'the real one' 'if [[ ${1:-} == fail ]]; then exit 42; fi' \
    'if [[ ${1:-} == wait ]]; then echo $$ >"$2"; exec sleep 1000; fi'
  fake "$work/by_name/colmap" 'by name' 'exec colmap "$@"'
}
fake "$work/other/colmap" 'the other one'
fake "$work/bin/graphmatch_matcher" 'the matcher' 'exit 3'
mkdir "$work/wrapper" "$work/copy" "$work/tools"
ln -s "$root/scripts/colmap" "$work/wrapper/colmap"
cp "$root/scripts/colmap" "$work/copy/colmap"
# A colmap that is installed plays no part: these directories are all that is looked into.
for tool in bash realpath sleep; do ln -s "$(type -P "$tool")" "$work/tools/$tool"; done
unset GRAPHMATCH_COLMAP GRAPHMATCH_COLMAP_PASSED

# on DIRECTORY...: PATH with these directories of the test alone.
on() {
  local path=$work/tools
  while (($# > 0)); do
    path=$work/${!#}:$path
    set -- "${@:1:$#-1}"
  done
  echo "PATH=$path"
}
usual=$(on wrapper real bin)

# Arguments as they are, and the exit code.
expect_exit 0 '' env "$usual" colmap mapper '' 'two  words' '*' --a=b
expect_lines 'the real one' mapper '' 'two  words' '*' --a=b
expect_exit 42 '' env "$usual" colmap fail
expect_exit 0 '' env "$usual" colmap help vocab_tree_matcher
expect_lines 'the real one' help vocab_tree_matcher

# The standard input, and signals: it is the process of COLMAP.
# shellcheck disable=SC2016
fake "$work/reader/colmap" 'the reader' 'while read -r line; do echo "$line"; done'
echo 'from outside' >"$work/input.txt"
expect_exit 0 '' env "$(on wrapper reader)" colmap <"$work/input.txt"
expect_lines 'the reader' 'from outside'
env "$usual" colmap wait "$work/pid" >"$work/wait.txt" &
started=$!
until [[ -s $work/pid ]]; do sleep 0.05; done
[[ $(<"$work/pid") == "$started" ]] || fail "COLMAP is another process than the one that was started"
kill -TERM "$started"
code=0
wait "$started" || code=$?
((code == 143)) || fail "exit code $code after SIGTERM"

# vocab_tree_matcher, and only there.
real=$work/real/colmap
expect_exit 3 '' env "$usual" colmap vocab_tree_matcher --database_path 'a b.db' --VocabTreeMatching.vocab_tree_path t
expect_lines 'the matcher' --database_path 'a b.db' --VocabTreeMatching.vocab_tree_path t --colmap_path "$real"
expect_exit 3 '' env "$usual" colmap vocab_tree_matcher
expect_lines 'the matcher' --colmap_path "$real"
for given in '--colmap_path x' --colmap_path=x '--colmap x' --co=x; do
  read -r -a arguments <<<"$given"
  expect_exit 3 '' env "$usual" colmap vocab_tree_matcher "${arguments[@]}"
  expect_lines 'the matcher' "${arguments[@]}"
done
expect_exit 127 'There is no graphmatch_matcher on PATH' env "$(on wrapper real)" colmap vocab_tree_matcher
# The matcher of the wrapper's own installation goes before one on PATH.
mkdir -p "$work/prefix/libexec/colmap-graphmatch"
cp "$root/scripts/colmap" "$work/prefix/libexec/colmap-graphmatch/"
fake "$work/prefix/bin/graphmatch_matcher" 'the matcher beside it'
expect_exit 0 '' env "$(on prefix/libexec/colmap-graphmatch real bin)" colmap vocab_tree_matcher
expect_lines 'the matcher beside it' --colmap_path "$real"

# Which COLMAP.
expect_exit 0 'the other one' env "$(on wrapper other real)" colmap help
expect_exit 0 'the real one' env "$usual" GRAPHMATCH_COLMAP="$real" colmap help
expect_exit 0 'the other one' env "$usual" GRAPHMATCH_COLMAP="$work/other/colmap" colmap help
expect_exit 3 "$work/other/colmap" env "$usual" GRAPHMATCH_COLMAP="$work/other/colmap" colmap vocab_tree_matcher
expect_exit 127 'which is no program' env "$usual" GRAPHMATCH_COLMAP="$work/nothing" colmap help
expect_exit 127 'which is this very file' env "$usual" GRAPHMATCH_COLMAP="$work/wrapper/colmap" colmap help
expect_exit 127 'There is no other colmap on PATH' env "$(on wrapper bin)" colmap help

# Never in a circle: the directory twice, copies of the wrapper, and programs that call `colmap` in their turn.
expect_exit 0 '' env "$(on wrapper wrapper real)" colmap help
expect_lines 'the real one' help
expect_exit 127 'There is no other colmap on PATH' env "$(on wrapper wrapper bin)" colmap help
expect_exit 127 'There is no other colmap on PATH' env "$(on wrapper copy bin)" colmap help
expect_exit 0 '' env "$(on wrapper copy real)" colmap help
expect_lines 'the real one' help
expect_exit 0 '' env "$(on wrapper by_name copy real)" colmap help
expect_lines 'by name' help 'the real one' help
expect_exit 127 'There is no other colmap on PATH' env "$(on wrapper by_name copy)" colmap help
expect_exit 0 '' env "$usual" GRAPHMATCH_COLMAP="$work/by_name/colmap" colmap help
expect_lines 'by name' help 'the real one' help

# A matcher that is told `--colmap_path colmap` comes by here again, and on to COLMAP.
# shellcheck disable=SC2016
fake "$work/asking/graphmatch_matcher" 'the matcher' 'exec colmap help'
expect_exit 0 '' env "$(on wrapper real asking)" colmap vocab_tree_matcher --colmap_path colmap
expect_lines 'the matcher' --colmap_path colmap 'the real one' help

# With the programs themselves.
colmap=$(type -P colmap) || { echo "COLMAP is not installed."; exit 77; }
theirs=$("$colmap" help 2>&1)
ours=$(PATH=$work/wrapper:$PATH colmap help 2>&1)
[[ $theirs == "$ours" ]] || fail "colmap help: $ours"
"$build/tests/make_synthetic_database" "$work/database.db" 2 5
PATH=$work/wrapper:$build/colmap_graphmatch:$PATH expect_exit 0 'Pairs tested' \
  env colmap vocab_tree_matcher --database_path "$work/database.db" --SiftMatching.use_gpu 0 \
  --VocabTreeMatching.vocab_tree_path "$work/no_tree.bin"
check_integrity "$work/database.db"
