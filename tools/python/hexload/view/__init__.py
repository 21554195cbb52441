"""The live page: sources give frames, scene and curves show them, controls send commands."""
