"""Check the owner and mode of a folder whose files are run, as compiled kernels are."""

from __future__ import annotations

import os
import stat
from pathlib import Path


def why_untrusted(folder: Path) -> str | None:
    """Return the reason why users other than this one and root can write to a folder, or replace it.

    Parameters
    ----------
    folder : Path
        Need not be there yet; links are followed.

    Returns
    -------
    str or None
        One sentence with the path, the owner or mode found and what to do; None where no other user can write. Always
        None where the system has no owners of files as POSIX has them.
    """
    if not hasattr(os, "geteuid"):
        return None
    whole = folder.resolve()
    for path in (whole, *whole.parents):
        try:
            state = path.stat()
        except FileNotFoundError:
            continue
        except OSError as error:
            return f"{path} cannot be looked at ({error.strerror}): expected a folder of this user"
        if found := _found(state, is_parent=path != whole):
            return f"{path} {found}: expected this user's own folder with mode 0755; chmod go-w, or name another folder"
    return None


def is_trusted_file(path: Path) -> bool:
    """Return whether a file is this user's or root's and no other user can write; raises `FileNotFoundError`."""
    if not hasattr(os, "geteuid"):
        return True
    state = path.stat(follow_symlinks=False)
    return stat.S_ISREG(state.st_mode) and _found(state, is_parent=False) is None


def _found(state: os.stat_result, *, is_parent: bool) -> str | None:
    """Return what is wrong with one file or folder."""
    if state.st_uid not in (0, os.geteuid()):
        return f"belongs to the user {state.st_uid}"
    # In a folder with the sticky bit, such as /tmp, users can replace their own files only.
    if is_parent and state.st_mode & stat.S_ISVTX:
        return None
    if state.st_mode & stat.S_IWOTH:
        return f"may be written to by everybody (mode {stat.S_IMODE(state.st_mode):04o})"
    if state.st_mode & stat.S_IWGRP and not _is_private(state.st_gid):
        return f"may be written to by the group {state.st_gid} (mode {stat.S_IMODE(state.st_mode):04o})"
    return None


def _is_private(group: int) -> bool:
    """Tell whether a group is this user's alone, as many systems give one to each user, or root's."""
    import grp
    import pwd

    if group == 0:
        return True
    try:
        user, found = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
    except KeyError:
        return False
    return user.pw_gid == group and found.gr_name == user.pw_name and set(found.gr_mem) <= {user.pw_name}
