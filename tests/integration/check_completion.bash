# SPDX-License-Identifier: Apache-2.0
# check_completion.bash TOOL SCRIPT: what bash offers for words of a command line.
tool=$1
source "$2" || exit 1
failures=0

# offers "EXPECTED..." WORD...: the last word is being typed.
offers() {
  local expected=$1
  shift
  COMP_WORDS=("$tool" "$@") COMP_CWORD=$#
  _farfield
  if [[ "${COMPREPLY[*]}" != "$expected" ]]; then
    echo "farfield $* offers '${COMPREPLY[*]}', not '$expected'"
    failures=$((failures + 1))
  fi
}

offers "bake" ba
offers "bake info analyse verify evaluate export render shot trade why sky" ""
offers "--version" --ver
offers "--budget" render --bud
offers "--no-sky --no-displacement" render scene.glb -o out.exr --no
offers "-o" bake -o
offers "--level" export --le
offers "" verify --bud
offers "" bake oa # files are bash's own

[[ $(complete -p farfield) == *"-o default"* ]] || { echo "files are not completed"; exit 1; }
exit $((failures > 0))
