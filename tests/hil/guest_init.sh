#!/bin/sh
# First process of the guest kernel: bring up vcan0 and vcan1, run the command, leave its exit code, power off.
#
# RUN_DIR (from the kernel's command line) holds busybox, modules/, command.sh; into it go `ready`
# once they are up, `output.txt`, and `exit_code` (the kernel itself always ends with 0).
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
bb="$RUN_DIR/busybox"
root=/run/root

say_and_stop() {
    echo "guest: $1"
    echo o > /proc/sysrq-trigger
    sleep 60
}

"$bb" mount -t proc proc /proc
"$bb" mount -t sysfs sysfs /sys
"$bb" mount -t hostfs -o "$RUN_DIR" none "$RUN_DIR" || say_and_stop "no writable result folder"

for module in fs/overlayfs/overlay net/can/can net/can/can-raw net/can/can-bcm net/can/can-gw \
        drivers/net/can/dev/can-dev drivers/net/can/vcan drivers/net/can/slcan/slcan; do
    "$bb" insmod "$RUN_DIR/modules/kernel/$module.ko" || say_and_stop "no module $module"
done

# The host's files, with everything written kept in memory.
"$bb" mount -t tmpfs -o size=1g tmpfs /run
mkdir /run/upper /run/work "$root"
"$bb" mount -t overlay -o lowerdir=/,upperdir=/run/upper,workdir=/run/work overlay "$root" ||
    say_and_stop "no overlay"
"$bb" mount -t proc proc "$root/proc"
"$bb" mount -t sysfs sysfs "$root/sys"
"$bb" mount -t devtmpfs dev "$root/dev"
mkdir -p "$root/dev/shm" "$root/dev/pts"
"$bb" mount -t tmpfs tmpfs "$root/dev/shm"
"$bb" mount -t devpts devpts "$root/dev/pts"
"$bb" mount -t hostfs -o "$RUN_DIR" none "$root$RUN_DIR"

"$bb" ip link set lo up
for bus in vcan0 vcan1; do
    "$bb" ip link add "$bus" type vcan && "$bb" ip link set "$bus" up || say_and_stop "no $bus"
done
# Or frames are lost when many sockets listen.
echo 33554432 > /proc/sys/net/core/rmem_max
echo 8388608 > /proc/sys/net/core/rmem_default
echo 20000 > /proc/sys/net/core/netdev_max_backlog

echo ready > "$RUN_DIR/ready"
"$bb" chroot "$root" /bin/sh "$RUN_DIR/command.sh" > "$RUN_DIR/output.txt" 2>&1
echo $? > "$RUN_DIR/exit_code"
echo o > /proc/sysrq-trigger
sleep 60
