"""Print the summary: `PYTHONPATH=src:tests python -m hostile [FLIPS]`."""

import sys

from hostile.summary import results, table

if __name__ == "__main__":
    found = results(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000)
    print(table(found))
    sys.exit(any(result.outcome == "wrong" for result in found))
