"""Derives the names of packages, classes and libraries from an action's name, and checks which are
possible.

The engine takes the name of an action for its class and, in snake case, for its library
(docs/umrf-and-the-engine.md 5). Names that C++, the included headers, ROS or CMake use are listed
here.
"""

import errno
import re
import signal
from collections.abc import Iterable, Iterator
from typing import Final

import msgspec

from action_assistant.safe_text import hold_names


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


#: Keywords and alternative tokens up to C++20, and the namespaces that generated sources name.
CPP_KEYWORDS: Final = _words(
    """
    alignas alignof and and_eq asm atomic_cancel atomic_commit atomic_noexcept auto bitand bitor
    bool break case catch char char8_t char16_t char32_t class co_await co_return co_yield compl
    concept const const_cast consteval constexpr constinit continue decltype default delete do
    double dynamic_cast else enum explicit export extern false float for friend goto if inline
    int long mutable namespace new noexcept not not_eq nullptr operator or or_eq private
    protected public reflexpr register reinterpret_cast requires return short signed sizeof
    static static_assert static_cast struct switch synchronized template this thread_local throw
    true try typedef typeid typename typeof union unsigned using virtual void volatile wchar_t
    while xor xor_eq std boost
    """
)

#: Macros of headers that are no capitals alone; members of such a name get another.
LOWER_MACROS: Final = _words(
    """
    alloca assert assert_perror be16toh be32toh be64toh errno htobe16 htobe32 htobe64 htole16
    htole32 htole64 i386 issubnormal le16toh le32toh le64toh linux major makedev
    math_errhandling minor offsetof sa_handler sa_sigaction sched_priority setjmp si_addr
    si_band si_fd si_int si_pid si_ptr si_status si_uid si_value sigmask sigsetjmp st_atime
    st_ctime st_mtime stderr stdin stdout strdupa strndupa timeradd timerclear timercmp
    timerisset timersub unix va_arg va_copy va_end va_start
    """
)

#: Macros without a _ in them, which a class could be called by.
MACROS: Final = (
    frozenset(errno.errorcode.values())
    | {each.name for each in signal.Signals}
    | _words(
        """
    ACCESSPERMS ALLPERMS BUFSIZ CSIGNAL DEFFILEMODE EOF FAPPEND FASYNC FFSYNC FNDELAY FNONBLOCK
    INFINITY MAXFLOAT MINSIGSTKSZ NAN NDEBUG NFDBITS NGREG NSIG NULL NZERO SIGSTKSZ SNAN SNANF
    SNANL WCONTINUED WCOREDUMP WCOREFLAG WEOF WEXITED WEXITSTATUS WNOHANG WNOWAIT WSTOPPED
    WSTOPSIG WTERMSIG WUNTRACED
    """
    )
)

#: Classes that the source of an action sees, by the names that it uses itself.
CLASS_NAMES: Final = _words(
    """
    ActionBase ActionParameter ActionParameters TemotoAction TemotoError TemotoErrorStack Umrf
    UmrfNode UmrfNodeExec factory input_parameters_t output_parameters_t
    """
)

#: The library exports its action by its name, which the compiler takes for a second declaration.
C_FUNCTIONS: Final = _words(
    """
    abort abs accept access acos acosh acct alarm aligned_alloc asctime asin asinh at_quick_exit
    atan atan2 atanh atexit atof atoi atol atoll basename bind brk bsearch btowc cabs calloc
    cbrt ceil chdir chmod chown chroot clearenv clearerr clock clone close closelog confstr
    connect copysign cos cosh creat crypt ctermid ctime daemon difftime div dlclose dlerror
    dlopen dlsym dprintf dup dup2 dup3 endgrent erand48 erf erfc execl execle execlp execv
    execve execvp exit exp exp2 expm1 fabs faccessat fchdir fchmod fchown fclose fcntl fdim
    fdopen feof ferror fflush ffs fgetc fgetpos fgets fileno floor fma fmax fmemopen fmin fmod
    fopen fork fprintf fputc fputs fread free freopen frexp fscanf fseek fsetpos fstat fstatat
    fsync ftell ftok ftruncate futimens fwide fwprintf fwrite getc getchar getcwd getegid getenv
    geteuid getgid getline getlogin getopt getpgid getpgrp getpid getppid gets getsid getuid
    getw getwc gmtime gsignal hypot ilogb index initstate ioctl isalnum isalpha isatty isblank
    iscntrl isdigit isgraph islower isprint ispunct isspace isupper isxdigit jrand48 kill killpg
    labs ldexp ldiv lgamma link linkat listen llabs lldiv llrint llround localeconv localtime
    lockf log log10 log1p log2 logb longjmp lrand48 lrint lround lseek lstat main malloc mblen
    mbrlen mbrtowc mbsinit mbstowcs mbtowc memccpy memchr memcmp memcpy memmove memset mkdir
    mkdtemp mkfifo mknod mkstemp mktime modf mount mrand48 nan nanosleep nearbyint nextafter
    nice nrand48 open openat pathconf pause pclose perror pipe poll popen pow pread printf
    psignal ptrace putc putchar putenv puts putw pwrite qsort quick_exit raise rand random read
    readlink realloc realpath reboot recv regcomp regexec remainder remove remquo rename rewind
    rindex rint rmdir round sbrk scalbln scalbn scanf seed48 select send setbuf setegid setenv
    seteuid setgid setlocale setpgid setsid setstate setuid setvbuf shutdown sigaction sigaddset
    signal sigpause sigwait sin sinh sleep snprintf socket sprintf sqrt srand srandom sscanf
    stat stime strcat strchr strcmp strcoll strcpy strdup strerror strftime strlen strncat
    strncmp strncpy strpbrk strrchr strsep strspn strstr strtod strtof strtok strtol strtoul
    strxfrm swab symlink sync syscall sysconf system tan tanh tempnam tgamma time times tmpfile
    tmpnam toascii tolower toupper towctrans trunc truncate ttyname tzset umask umount uname
    ungetc unlink unsetenv usleep utime vfork vfprintf vprintf vscanf vsnprintf vsprintf wait
    wait3 wait4 waitid waitpid wcscat wcscmp wcscpy wcslen wctob wctomb wmemcpy wprintf write
    """
)

#: Packages of ROS 2 and of the engine, targets that CMake makes itself, libraries of the system, and
#: files that Windows cannot have.
PACKAGE_NAMES: Final = _words(
    """
    actionlib ament_cmake ament_index_cpp ament_package builtin_interfaces colcon geometry_msgs
    launch launch_ros nav_msgs rcl rclcpp rclcpp_action rclpy rcutils rmw ros ros2 rosidl
    sensor_msgs std_msgs std_srvs temoto_action_engine temoto_action_engine_ros2 temoto_msgs tf2
    tf2_ros all all_build clean depend edit_cache help install list_install_components package
    package_source preinstall rebuild_cache run_tests test uninstall zero_check boost build
    crypt devel dl include lib log pthread rt share src std stdc util aux com1 com2 com3 com4
    con lpt1 lpt2 lpt3 nul prn
    """
)


#: The most characters of a name; file systems have 255 bytes for it and what is added.
MAX_NAME: Final = 100
_IDENTIFIER: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_ROS_NAME: Final = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_CAPITALS: Final = re.compile(r"[A-Z][A-Z0-9_]+")


class NameRefusal(msgspec.Struct, frozen=True):
    """A reason for which there can be no package. `place` is a JSON pointer below the action's
    name, `reason` a sentence."""

    place: str
    reason: str

    def __post_init__(self) -> None:
        hold_names(self, "reason")

    @property
    def sentence(self) -> str:
        """The place and the reason, joined by a colon."""
        return f"{self.place}: {self.reason}"


def snake_case(name: str) -> str:
    """Return a name in snake case, as it names a package, a folder and a library: `TaURDF` becomes
    `ta_u_r_d_f`.

    Only ASCII letters change, as in the engine's locale.
    """
    first, rest = name[:1].translate(_LOWER), name[1:]
    return first + re.sub("[A-Z]", lambda found: "_" + found[0].translate(_LOWER), rest)


_LOWER: Final = {code: code + 32 for code in range(ord("A"), ord("Z") + 1)}


def check_name(name: str) -> tuple[NameRefusal, ...]:
    """Return the reasons against a package for an action of this name; empty if it is possible."""
    reason = next(_against(name), None)
    return () if reason is None else (NameRefusal(name, reason),)


def check_names(names: Iterable[str]) -> tuple[NameRefusal, ...]:
    """Return the reasons against packages for actions of these names, also if two names would give
    the same package."""
    listed = list(dict.fromkeys(names))
    found = [refusal for name in listed for refusal in check_name(name)]
    taken: dict[str, str] = {}
    for name in listed:
        other = taken.setdefault(snake_case(name), name)
        if other != name:
            same = f"“{name}” and “{other}” would both be the package “{snake_case(name)}”."
            found.append(NameRefusal(name, same))
    return tuple(found)


def check_package(package: str) -> tuple[NameRefusal, ...]:
    """Return the refusal of a package name, as the only member of a tuple; return an empty tuple if
    a package can have this name."""
    reason = next(_against_package(package), None)
    return () if reason is None else (NameRefusal(package, reason),)


def _against(name: str) -> Iterator[str]:
    """Yield reasons against an action's name, the gravest first."""
    package = snake_case(name)
    if not name:
        yield "The action has no name."
    if name in {"graph_entry", "graph_exit"}:
        yield f"“{name}” is the engine's own name of an end of each graph."
    if not _IDENTIFIER.fullmatch(name):
        yield (
            f"“{name}” is no name of a C++ class: it may have letters of ASCII, digits and _, and "
            "begins with no digit."
        )
    if name in CPP_KEYWORDS:
        yield f"“{name}” is a word of C++ itself, and no name of a class."
    if name in MACROS | LOWER_MACROS:
        yield f"“{name}” is a macro of C, and no name of a class."
    if name in CLASS_NAMES:
        yield f"“{name}” is a class that the engine or the package has already."
    if name in C_FUNCTIONS:
        yield f"“{name}” is a function of C; the library would give its own to the engine."
    yield from _against_package(package)


def _against_package(package: str) -> Iterator[str]:
    if len(package) > MAX_NAME:
        yield f"The package would be called by {len(package)} characters; it may be {MAX_NAME}."
    if not _ROS_NAME.fullmatch(package):
        yield (
            f"The package would be “{package}”, and ROS takes small letters and digits with single _ "
            "between them, the first a letter."
        )
    if len(package) < 2:
        yield f"The package would be “{package}”, and ROS wants two characters."
    if package in PACKAGE_NAMES:
        yield f"The package would be “{package}”, which ROS, CMake or the system have for themselves."


def member_name(key: str) -> str:
    """Return the C++ member for a key of parameters. Several keys may have the same member.

    Characters other than letters, digits and single _ between them become _; a name that C++ or a
    header uses gets one at its end.
    """
    word = re.sub("_+", "_", re.sub("[^A-Za-z0-9]", "_", key)).strip("_")
    if not word or word[0].isdigit():
        word = f"p_{word}".rstrip("_")
    taken = word in CPP_KEYWORDS or word in LOWER_MACROS or _CAPITALS.fullmatch(word)
    return f"{word}_" if taken else word
