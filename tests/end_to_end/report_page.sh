#!/bin/bash
# report_page.sh BUILD_DIR WORK_DIR: the page of a report, opened and used in a browser.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"
python=/usr/bin/python3
command -v chromium >/dev/null || { echo "Chromium is not installed."; exit 77; }
command -v chromedriver >/dev/null || { echo "chromium-driver is not installed."; exit 77; }
"$python" -c 'import selenium' 2>/dev/null || { echo "python3-selenium is not installed."; exit 77; }

"$python" "$root/tests/end_to_end/report_page.py" "$build/tests/make_html_report" "$work" || fail "report_page.py"
