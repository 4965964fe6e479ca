"""The notebooks of docs/how-to/notebooks run from their first cell to the last.

MBV_UPDATE_GOLDEN=1 writes them anew with their outputs, which are the pages that readers see.
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

FOLDER = pathlib.Path(os.environ["MBV_SOURCE"]) / "docs" / "how-to" / "notebooks"


def execute(notebooks, folder):
    """The notebooks run in `folder` by one process, or what it complains of."""
    copies = [pathlib.Path(shutil.copy(notebook, folder)) for notebook in notebooks]
    done = subprocess.run(
        [
            sys.executable, "-m", "nbconvert", "--to", "notebook", "--inplace", "--execute",
            "--ExecutePreprocessor.timeout=120", "--ClearMetadataPreprocessor.enabled=True",
            "--ClearMetadataPreprocessor.clear_notebook_metadata=False", *map(str, copies),
        ],
        cwd=folder, capture_output=True, text=True, check=False,
    )
    texts = [copy.read_text() for copy in copies] if done.returncode == 0 else None
    return texts, done.stderr


class Notebooks(unittest.TestCase):
    def test_run(self):
        notebooks = sorted(FOLDER.glob("*.ipynb"))
        self.assertGreaterEqual(len(notebooks), 8)
        with tempfile.TemporaryDirectory() as folder:
            texts, complaint = execute(notebooks, folder)
        self.assertIsNotNone(texts, complaint[-2000:])
        for notebook, text in zip(notebooks, texts, strict=True):
            with self.subTest(notebook.name):
                if os.environ.get("MBV_UPDATE_GOLDEN"):
                    notebook.write_text(text)
                shown = json.loads(notebook.read_text())["cells"]
                fresh = json.loads(text)["cells"]
                # What readers see was run, and has outputs where a run has some.
                for stored, run in zip(shown, fresh, strict=True):
                    kinds = [output["output_type"] for output in run.get("outputs", [])]
                    self.assertEqual(
                        [output["output_type"] for output in stored.get("outputs", [])], kinds
                    )

    def test_a_wrong_cell_is_noticed(self):
        cell = {"cell_type": "code", "id": "a", "metadata": {}, "outputs": [],
                "execution_count": None, "source": "assert 1 == 2"}
        kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
        with tempfile.TemporaryDirectory() as folder:
            notebook = pathlib.Path(folder) / "wrong.ipynb"
            notebook.write_text(json.dumps(
                {"cells": [cell], "metadata": {"kernelspec": kernel}, "nbformat": 4,
                 "nbformat_minor": 5}
            ))
            with tempfile.TemporaryDirectory() as elsewhere:
                texts, complaint = execute([notebook], elsewhere)
        self.assertIsNone(texts)
        self.assertIn("AssertionError", complaint)


if __name__ == "__main__":
    unittest.main()
