"""`python -m hexload_dev VERB ...`; users call it through tools/hexload, which does the set-up first."""

from hexload_dev.cli import main

main()
