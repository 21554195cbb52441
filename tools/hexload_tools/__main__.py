"""`python -m hexload_tools VERB ...`; users call it through tools/hexload, which does the set-up first."""

from hexload_tools.cli import main

main()
