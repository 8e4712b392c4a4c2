"""The page on catkin workspaces, command by command, by a new user of a Debian that has nothing else.

A minimal system is made by debootstrap, which needs root and a network. Of this machine it takes over where packages
come from, and which certificates count.
"""

import os
import re
import shlex
import shutil
import subprocess
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from solfer.middleware.ros.node.launch import free_port

pytestmark = [
    pytest.mark.soak,
    pytest.mark.skipif(
        os.geteuid() != 0 or shutil.which("debootstrap") is None, reason="a bare Debian needs root and debootstrap"
    ),
]

BLOCK = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)
MOUNTED = ("proc", "sys", "dev", "dev/shm")
SOURCES, PIP = Path("/etc/apt/sources.list.d/debian.sources"), Path("/etc/pip.conf")
CERTIFICATES = Path("/etc/ssl/certs/ca-certificates.crt")
OWN_CERTIFICATES = Path("/usr/local/share/ca-certificates")
LIMIT = 1200.0
"""Longest time of a step, such as the installation of all packages [s]."""

SESSION = """
set -e
. ~/solfer_env/bin/activate
. {setup}
export ROS_MASTER_URI=http://localhost:{port}
roslaunch -p {port} {launch} > ~/launch.log 2>&1 &
trap 'kill -INT $!; wait $!' EXIT
timeout 60 sh -c 'until rostopic list > ~/topics 2>&1; do sleep 1; done' || {{ cat ~/launch.log; exit 1; }}
timeout 300 rostopic echo -n 1 -p {topic} || {{ cat ~/launch.log; exit 1; }}
{request}
sleep 6
timeout 60 rostopic echo -n 200 -p {topic}
"""
"""A robot of a launch file that gets a request, and the numbers of a topic before and after it."""


class BareDebian:
    """A minimal Debian in a folder, with a user `dev` and the repository's last commit as `/srv/solfer.git`."""

    def __init__(self, folder: Path, suite: str, repository: Path, stack: ExitStack):
        self._folder = folder
        made = ["debootstrap", "--variant=minbase", "--include=sudo,ca-certificates,git", suite, str(folder)]
        self._checked(made)
        if SOURCES.exists():
            (folder / "etc/apt/sources.list").unlink(missing_ok=True)
            (folder / SOURCES.relative_to("/")).write_text(SOURCES.read_text().replace("bookworm", suite))
        for file in (
            PIP,
            CERTIFICATES,
            Path("/etc/resolv.conf"),
            Path("/etc/hosts"),
            *Path("/etc/apt").glob("*.d/99*"),
        ):
            if file.exists():
                shutil.copy(file, folder / file.relative_to("/"))
        if OWN_CERTIFICATES.is_dir():  # packages make the list again
            shutil.copytree(OWN_CERTIFICATES, folder / OWN_CERTIFICATES.relative_to("/"), dirs_exist_ok=True)
        for place in MOUNTED:
            self._checked(["mount", "--bind", f"/{place}", str(folder / place)])
            stack.callback(subprocess.run, ["umount", "-l", str(folder / place)], check=True)
        self._checked(["git", "clone", "-q", "--bare", str(repository), str(folder / "srv/solfer.git")])
        self._checked(["chroot", str(folder), "useradd", "-m", "-d", "/srv/dev", "-s", "/bin/bash", "dev"])
        self._checked(["chroot", str(folder), "chown", "-R", "dev:", "/srv/solfer.git"])
        (folder / "etc/sudoers.d/dev").write_text("dev ALL=(ALL) NOPASSWD: ALL\n")

    def run(self, script: str) -> str:
        """Run a script of bash as the user; return what it prints."""
        environment = [
            "HOME=/srv/dev",
            "USER=dev",
            "LANG=C.UTF-8",
            "PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin",
        ]
        environment += [f"PIP_CERT={CERTIFICATES}", "DEBIAN_FRONTEND=noninteractive"]
        user = ["setpriv", "--reuid=dev", "--regid=dev", "--init-groups", "bash", "-c", f"cd\n{script}"]
        return self._checked(["chroot", str(self._folder), "env", "-i", *environment, *user])

    def request(self, setup: str, launch: str, topic: str, request: str) -> list[float]:
        """Start a robot, send a request; return how far the numbers of a topic have moved."""
        launch = launch.removeprefix("roslaunch ")
        done = self.run(SESSION.format(setup=setup, launch=launch, topic=topic, request=request, port=free_port()))
        rows = [
            [float(each) for each in line.split(",")[1:]] for line in re.findall(r"^\d{12,},.*$", done, re.MULTILINE)
        ]
        assert len(rows) > 100, done
        return np.ptp(rows, axis=0).tolist()

    @staticmethod
    def _checked(command: list[str]) -> str:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            timeout=LIMIT, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{shlex.join(command)}\n{done.stdout[-8000:]}"
        return done.stdout


@pytest.fixture(scope="module")
def page(repository):
    """Return the blocks of commands of the page: build, run, request, drive, overlay."""
    return BLOCK.findall((repository / "docs/how-to/catkin_workspace.md").read_text())


@pytest.fixture(scope="module", params=["bookworm", "trixie"])
def debian(request, repository, page, tmp_path_factory):
    """Make a bare system in which solfer was built by the commands of the page."""
    with ExitStack() as stack:
        folder = tmp_path_factory.mktemp(request.param)
        folder.chmod(0o755)  # the user's root
        stack.callback(subprocess.run, ["rm", "-rf", "--one-file-system", str(folder)], check=True)
        system = BareDebian(folder, request.param, repository, stack)
        system.run("set -e\n" + page[0].replace(" URL ", " /srv/solfer.git "))
        yield system


def moves_joints(debian, page, setup):
    """Return whether the request of the page, once it is accepted, has moved the legs."""
    launch, request = (page[number].splitlines()[-1] for number in (1, 2))
    accepted = f"timeout 60 sh -c 'until {request} | grep \"success: True\"; do sleep 1; done'"
    return max(debian.request(setup, launch, "/joint_states/position", accepted)) > 0.3


def test_the_robot_moves_and_drives(debian, page):
    setup = "~/my_ws/devel/setup.sh"
    assert moves_joints(debian, page, setup)
    launch, drive = page[3].splitlines()
    drive = f"timeout 100 {drive} || true"  # kernels are compiled before the first motion
    ahead, aside, _ = debian.request(setup, launch, "/floating_base/pose/pose/position", drive)
    assert ahead > 0.4
    assert aside < 0.05 * ahead


def test_an_overlay_is_built_and_moves_a_joint(debian, page):
    *build, _, launch = page[4].splitlines()
    debian.run("\n".join(["set -e", ". ~/solfer_env/bin/activate", ". ~/my_ws/devel/setup.sh", *build]))
    moved = debian.request("~/over_ws/devel/setup.sh", launch, "/joint_states/position", "true")
    assert max(moved) > 0.05


def test_an_install_space_needs_no_source(debian, page):
    """The last one: the source is moved away."""
    debian.run(
        "set -e\n. ~/solfer_env/bin/activate\ncatkin_make -C ~/my_ws install\n"
        "mkdir ~/elsewhere && mv ~/my_ws/src ~/my_ws/devel ~/my_ws/build ~/elsewhere"
    )
    assert moves_joints(debian, page, "~/my_ws/install/setup.sh")
