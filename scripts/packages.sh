# Finding Rust, and installing system packages on Debian and its kin; sourced by run.sh and test.sh.

# need PACKAGE...: installs those that are missing, or says in one line which they are and stops.
need() {
    command -v dpkg-query >/dev/null || return 0 # Other systems: packages are left to the user.
    local package missing=()
    for package in "$@"; do
        dpkg-query --show --showformat '${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed ||
            missing+=("$package")
    done
    ((${#missing[@]})) || return 0
    local root=()
    if [[ $(id -u) != 0 ]]; then
        # Asking for a password is fine for a person at a terminal, but would hang anywhere else.
        if command -v sudo >/dev/null && { sudo -n true 2>/dev/null || [[ -t 0 ]]; }; then
            root=(sudo)
        else
            echo "Missing system packages; install them with: apt-get install ${missing[*]}" >&2
            return 1
        fi
    fi
    echo "Installing system packages: ${missing[*]}" >&2
    "${root[@]}" apt-get update -qq </dev/null || true # An old list may still do.
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "${missing[@]}" </dev/null >/dev/null || {
        echo "Installing failed; install them with: apt-get install ${missing[*]}" >&2
        return 1
    }
}

# A shell that was open when Rust was installed does not know of it yet.
command -v cargo >/dev/null || PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
command -v cargo >/dev/null || {
    echo "Rust is missing; install it from https://rustup.rs" >&2
    exit 1
}

# What linking needs beyond Rust itself.
linker=()
command -v cc >/dev/null || linker=(gcc libc6-dev)

# What a window needs: the libraries that are opened while the program runs, and a Vulkan driver that also
# works without a graphics card.
window=(
    libvulkan1 mesa-vulkan-drivers
    libx11-6 libx11-xcb1 libxcb1 libxcursor1 libxi6
    libxkbcommon0 libxkbcommon-x11-0 libwayland-client0
)
