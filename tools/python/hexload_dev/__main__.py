"""`python -m hexload_dev VERB ...`; users call it through tools/hexload, which does the set-up first."""

from hexload_dev.cli import main

if __name__ == "__main__":  # not in the processes of a campaign
    main()
