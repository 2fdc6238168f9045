#!/bin/sh
# Makes the pictures of the documentation: opens the real window on a display of its own and drives it as a user would.
#   scripts/pictures.sh [FOLDER]      (default docs/pictures)
# Needs Xvfb, xdotool and ImageMagick.
set -eu
cd "$(dirname "$0")/.."
folder=${1:-docs/pictures}
for tool in Xvfb xdotool import compare; do
    command -v "$tool" >/dev/null || { echo "$0: $tool is missing (apt install xvfb xdotool imagemagick)" >&2; exit 1; }
done
cargo build -p plait
mkdir -p "$folder"
work=$(mktemp -d)

number=90
while [ -e "/tmp/.X11-unix/X$number" ]; do number=$((number + 1)); done
export DISPLAY=":$number"
unset WAYLAND_DISPLAY || true
Xvfb "$DISPLAY" -screen 0 1440x900x24 >/dev/null 2>&1 &
server=$!
program=
finish() {
    [ -z "$program" ] || kill "$program" 2>/dev/null || true
    kill "$server" 2>/dev/null || true
    rm -rf "$work"
}
trap finish EXIT INT TERM
while [ ! -e "/tmp/.X11-unix/X$number" ]; do sleep 0.1; done

# Waits until the window shows the same for a second, at most a minute.
settle() {
    same=0 tries=0
    import -window root "$work/before.png"
    while [ "$same" -lt 4 ] && [ "$tries" -lt 240 ]; do
        sleep 0.25
        import -window root "$work/now.png"
        if cmp -s "$work/before.png" "$work/now.png"; then same=$((same + 1)); else same=0; fi
        mv "$work/now.png" "$work/before.png"
        tries=$((tries + 1))
    done
}

picture() {
    settle
    import -window root -strip "$folder/$1.png"
    echo "$folder/$1.png"
}

open() {
    [ -z "$program" ] || kill "$program" 2>/dev/null || true
    ./target/debug/plait "$1" 2>"$work/errors" &
    program=$!
    window=$(xdotool search --sync --onlyvisible --name '^Plait' | head -n 1)
    xdotool mousemove 20 800 windowfocus --sync "$window"
    settle
}

# A pointer comes to a place by moving, not by jumping.
point() {
    xdotool mousemove "$(($1 - 9))" "$2" sleep 0.1 mousemove "$1" "$2"
    settle
}

place() {
    point "$1" "$2"
    xdotool click 1
    settle
}

# Drags from a place to another, and lets go there.
drag() {
    xdotool mousemove "$1" "$2" mousedown 1
    for k in 1 2 3 4 5 6; do
        xdotool mousemove "$(($1 + ($3 - $1) * k / 6))" "$(($2 + ($4 - $2) * k / 6))" sleep 0.1
    done
    xdotool mouseup 1
    settle
}

open creature
drag 525 432 597 396
drag 400 455 320 460
picture anchors
xdotool key Escape
settle
point 530 480
picture hover
xdotool click 5
picture alternative
xdotool click 4
settle
xdotool click 1
settle
place 750 310
picture red
xdotool mousemove 20 800 key s
picture three-strips
for _ in 1 2 3 4 5 6; do
    xdotool key s
    settle
done
picture regions
# Without stripes and region colours.
xdotool key 1 key 2
picture layout
