"""What only developers of hexload need: build, test, bench, soak, virtual machine, doctor, emulated targets."""
