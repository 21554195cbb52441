"""The simulator, the virtual controller and the bridge as child processes."""
