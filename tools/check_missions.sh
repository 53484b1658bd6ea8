# The step of action.yml: checks the missions that git knows, writes the report, and tells GitHub each finding at its line.
# MISSIONS: patterns of git; OPTIONS: of pbpp check; SARIF: the report. Neither is evaluated by the shell: they come from a workflow's file.
set -euo pipefail
set -f # a pattern is git's to match
read -r -a patterns <<< "$MISSIONS"
read -r -a options <<< "$OPTIONS"
mapfile -d '' -t missions < <(git ls-files -z -- "${patterns[@]}")
if [ "${#missions[@]}" -eq 0 ]; then
  echo "::error::no mission matches: $MISSIONS"
  exit 3
fi
code=0
pbpp check "${options[@]}" --format sarif -- "${missions[@]}" > "$SARIF" || code=$?
if [ -s "$SARIF" ]; then python "$(dirname "$0")/annotations.py" "$SARIF"; fi # none where the options are wrong
exit "$code"
