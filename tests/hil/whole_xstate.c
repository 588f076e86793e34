/* For a kernel of user-mode-linux on processors with AMX: preloaded, it wraps ptrace().
 *
 * Linux accepts PTRACE_SETREGSET of NT_X86_XSTATE only with the processor's whole area of extended
 * state, which AMX makes four times as long as the guest's kernel knows. This writes what the guest
 * gives over the beginning of the present area, and marks the state of AMX as unused. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

#define HEADER 512      /* its first bytes are flags of the parts in use; AMX has bits 17 and 18 */
#define AMX_BITS 0x06   /* in the third byte */

typedef long (*ptrace_t)(enum __ptrace_request, pid_t, void *, void *);

long ptrace(enum __ptrace_request request, ...)
{
    static ptrace_t real;
    static unsigned char whole[1 << 16];
    va_list arguments;
    va_start(arguments, request);
    pid_t pid = va_arg(arguments, pid_t);
    void *address = va_arg(arguments, void *);
    void *data = va_arg(arguments, void *);
    va_end(arguments);
    if (!real)
        real = (ptrace_t)dlsym(RTLD_NEXT, "ptrace");
    if (request == PTRACE_SETREGSET && (long)address == NT_X86_XSTATE) {
        const struct iovec *given = data;
        struct iovec area = {whole, sizeof whole};
        if (real(PTRACE_GETREGSET, pid, address, &area) == 0 && area.iov_len > given->iov_len) {
            memcpy(whole, given->iov_base, given->iov_len);
            whole[HEADER + 2] &= ~AMX_BITS;
            return real(PTRACE_SETREGSET, pid, address, &area);
        }
    }
    return real(request, pid, address, data);
}
