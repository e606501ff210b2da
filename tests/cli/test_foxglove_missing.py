"""`busflow foxglove` where its extra is not installed."""

import subprocess
import sys


def test_it_says_what_to_install():
    program = "import sys; sys.modules['websockets'] = None; from busflow.cli import main; sys.exit(main(['foxglove']))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 2
    assert (
        done.stderr.splitlines()[0] == "error: busflow foxglove needs one more package: pip install 'busflow[foxglove]'"
    )
    assert done.stdout == ""
