# shellcheck shell=bash
# Bare Debian trees by debootstrap, as root, for scripts that try the package where nothing is installed. To be sourced.
# The functions work on `tree`, of the release `release`, from the mirror `mirror`.

# The mirror of Debian itself that apt uses here.
mirror_of_host() {
  apt-get indextargets --format "\$(REPO_URI)" 'Created-By: Packages' 'Label: Debian' | head -n 1
}

# Fails with the reason when no tree can be made here.
require_trees() {
  ((EUID == 0)) || fail "only root can make a tree"
  command -v debootstrap >/dev/null || fail "debootstrap is missing: apt-get install debootstrap"
  [[ -n $mirror ]] || fail "apt tells no Debian mirror here: name one with --mirror"
}

# Runs commands in the tree. What they mount and start ends with them.
in_tree() {
  # shellcheck disable=SC2016,SC2154
  unshare --mount --pid --fork --kill-child bash -euc '
    mount -t proc proc "$1/proc"
    mount -t devpts devpts "$1/dev/pts"
    mount -t tmpfs tmpfs "$1/dev/shm"
    exec chroot "$1" env --ignore-environment HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin \
      DEBIAN_FRONTEND=noninteractive QT_QPA_PLATFORM=offscreen MPLBACKEND=Agg ${http_proxy:+http_proxy="$http_proxy"} \
      bash -euo pipefail -c "$2"' in_tree "$tree" "$1"
}

# In each tree from before anything else is until after everything else is gone.
readonly tree_marker=.visual_localization_tree

# Whether make_tree() has made the tree to its end.
is_tree() { is_own_tree && [[ -e $tree/root/.is_whole ]]; }

# Whether these are this user's, and nobody else may write there. What root runs in a tree, nobody else may have put in.
is_ours() { [[ -z $(find "$@" -maxdepth 0 \( ! -uid "$EUID" -o -perm /022 \) 2>&1) ]]; }

# Whether the folder itself, no link to one, is a tree that make_tree() began.
is_own_tree() {
  [[ -d $tree && ! -L $tree && -f $tree/$tree_marker && ! -L $tree/$tree_marker ]] \
    && is_ours "$tree" "$tree/$tree_marker"
}

# Fails when something else is where the tree is to be. What was not made here is never deleted.
require_own_tree() {
  if is_own_tree || [[ ! -e $tree && ! -L $tree ]]; then return; fi
  if [[ -d $tree && ! -L $tree && -z $(ls -A "$tree") ]] && is_ours "$tree"; then return; fi
  fail "$tree is no tree of this script (without $tree_marker, or others may write there): delete it yourself," \
    "or name another folder"
}

# Nothing, where there is no tree.
remove_tree() {
  require_own_tree
  if ! is_own_tree; then return; fi
  find "$tree" -mindepth 1 -maxdepth 1 ! -name "$tree_marker" -exec rm -rf --one-file-system {} + \
    && rm "$tree/$tree_marker" \
    && rmdir "$tree"
}

# Chained by &&: where the steps are called, set -e is without effect. policy-rc.d keeps services from starting. Files
# are put in place of what is there, for a link would lead out of the tree.
make_tree() {
  # shellcheck disable=SC2154
  remove_tree \
    && install --directory --mode 755 "$tree" \
    && install --mode 644 /dev/null "$tree/$tree_marker" \
    && debootstrap --variant=minbase --include=ca-certificates "$release" "$tree" "$mirror" \
    && install --mode 644 /etc/hosts /etc/resolv.conf "$tree/etc/" \
    && install -m 755 /dev/stdin "$tree/usr/sbin/policy-rc.d" <<<$'#!/bin/sh\nexit 101' \
    && touch "$tree/root/.is_whole"
}

# Installs the Debian package `package` with all that it needs.
install_package() {
  # shellcheck disable=SC2154
  install --mode 644 "$package" "$tree/root/visual-localization.deb" && in_tree 'apt-get update
    apt-get install --yes --no-install-recommends --reinstall /root/visual-localization.deb'
}

# As a user would: the programs, the nodelet in a manager with a real roscore, every launch file.
try_package() {
  # shellcheck disable=SC2154
  install -m 755 "$repo/scripts/try_installed.sh" "$tree/root/" && in_tree 'rm -rf /root/try
    /root/try_installed.sh /root/try'
}
