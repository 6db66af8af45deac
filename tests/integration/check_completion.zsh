# SPDX-License-Identifier: Apache-2.0
# check_completion.zsh TOOL SCRIPT: what zsh is given to choose from for words of a command line.
tool=$1
source $2 || exit 1
failures=0

# The two builtins of completion that the script calls; zsh itself leaves out what does not begin like the word.
compadd() { shift; offered=("$@") }
_files() { offered=(files) }

# offers "EXPECTED..." WORD...: the last word is being typed.
offers() {
  local expected=$1
  shift
  words=($tool "$@") CURRENT=$(($# + 1)) offered=()
  _farfield
  local found=" $offered "
  for word in ${=expected}; do
    [[ $found == *" $word "* ]] && continue
    print "farfield $* offers '$offered', not '$word'"
    failures=$((failures + 1))
  done
}

offers "bake info analyse verify evaluate export render shot trade why sky" ""
offers "--help --version" --ver
offers "-o --output --budget --no-sky" render --bud
offers "-o --finest-grid" bake -o
offers "files" bake oa

words=($tool verify --bud) CURRENT=3 offered=()
_farfield
[[ " $offered " == *" --budget "* ]] && { print "verify has no --budget"; failures=$((failures + 1)) }

# As zsh loads it: found by its first line, and the name of the file is the function's.
[[ $(head -1 $2) == "#compdef farfield" && ${2:t} == _farfield ]] || { print "zsh would not find it"; failures=$((failures + 1)) }
exit $((failures > 0))
