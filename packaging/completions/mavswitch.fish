# Print an optspec for argparse to handle cmd's options that are independent of any subcommand.
function __fish_mavswitch_global_optspecs
    string join \n c/config= learn= strict= route-age= sniffer= dialect= metrics= key= control= system= component= record= record-telemetry= record-when= record-max-size= record-max-time= record-min-free= record-max-files= flight-log= flight-log-system= v/verbose q/quiet log-format= h/help V/version
end

function __fish_mavswitch_needs_command
    # Figure out if the current invocation already has a command.
    set -l cmd (commandline -opc)
    set -e cmd[1]
    argparse -s (__fish_mavswitch_global_optspecs) -- $cmd 2>/dev/null
    or return
    if set -q argv[1]
        # Also print the command, so this can be used to figure out what it is.
        echo $argv[1]
        return 1
    end
    return 0
end

function __fish_mavswitch_using_subcommand
    set -l cmd (__fish_mavswitch_needs_command)
    test -z "$cmd"
    and return 1
    contains -- $cmd[1] $argv
end

complete -c mavswitch -n "__fish_mavswitch_needs_command" -s c -l config -d 'Read this configuration file, and not those in /etc/mavswitch' -r -F
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l learn -d 'Learn routes from every frame, or from HEARTBEAT only [default: all]' -r -f -a "all\t'Every frame that passed a full check'
heartbeat\t'HEARTBEAT frames'"
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l strict -d 'Send nothing to components that were never heard, not even to their system\'s links' -r -f -a "true\t''
false\t''"
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l route-age -d 'Forget a route that was silent for so many seconds; 0: never [default: 300]' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l sniffer -d 'Send everything to the links on which this system id is heard, whoever it is for' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l dialect -d 'Know the messages of this XML definition file too; may be repeated' -r -F
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l metrics -d 'Serve metrics for Prometheus, and a status page, by HTTP at this address and port' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l key -d 'A signing key that endpoints may name, and the file that it is in; may be repeated' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l control -d 'Where to have the control socket, by which `mavswitch status` and others ask; off: nowhere' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l system -d 'Be a component of this system: send HEARTBEAT, answer TIMESYNC and PING, measure links' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l component -d 'The component id of that component [default: 191]' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l record -d 'Record all traffic to this directory, as telemetry logs (.tlog)' -r -F
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l record-telemetry -d 'Record all traffic, if there is a directory for it [default: true]' -r -f -a "true\t''
false\t''"
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l record-when -d 'When to record [default: always]' -r -f -a "always\t'As long as the program runs'
armed\t'While a vehicle is armed'"
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l record-max-size -d 'Begin another telemetry log after so many bytes, as 100M; 0: never [default: 0]' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l record-max-time -d 'Begin another telemetry log after so long, as 30m; 0: never [default: 0]' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l record-min-free -d 'Delete the oldest records so that so much of the disk is free; 0: never [default: 100M]' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l record-max-files -d 'Delete the oldest records so that there are no more; 0: never [default: 0]' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l flight-log -d 'Ask vehicles for the logs that they make, and record these as well [default: off]' -r -f -a "off\t'None'
auto\t'What each vehicle makes: ULog of PX4, DataFlash blocks of ArduPilot'
ulog\t'ULog, whatever the vehicle'
dataflash\t'DataFlash blocks, whatever the vehicle'"
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l flight-log-system -d 'Ask only the vehicle with this system id for its logs' -r
complete -c mavswitch -n "__fish_mavswitch_needs_command" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_needs_command" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -s V -l version -d 'Print version'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "dialect" -d 'Print the messages that a definition file declares, as rows of the built-in table'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "ports" -d 'List the serial ports of this computer: what each one is, and whether you may open it'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "completions" -d 'Print what a shell needs to complete command lines, for its directory of completions'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "check" -d 'Check a configuration file, and tell what it means and what is missing; opens no endpoint'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "import" -d 'Print what a configuration of mavlink-router means, as a file of mavswitch'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "log" -d 'Work on telemetry logs: info, cut, merge, filter'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "status" -d 'Tell what is going on in a running mavswitch: endpoints, links, components, messages'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "why" -d 'Explain why a frame goes where it goes; without arguments, tell what looks wrong'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "listen" -d 'Print frames as they pass through a running mavswitch, with their fields'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "endpoint" -d 'Add, change, remove, enable or disable an endpoint of a running mavswitch'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "top" -d 'Watch what is going on in a running mavswitch, live on the terminal'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "record" -d 'Have a running mavswitch start or stop to record telemetry'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "reload" -d 'Have a running mavswitch read its configuration anew; if anything is wrong, fail and say what'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "log-level" -d 'Have a running mavswitch log more or less'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "config" -d 'Print the effective configuration, of files and command line together, as a file'
complete -c mavswitch -n "__fish_mavswitch_needs_command" -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand dialect" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand dialect" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand dialect" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand dialect" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand ports" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand ports" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand ports" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand ports" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand completions" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand completions" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand completions" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand completions" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand check" -s c -l config -d 'The same, as the router takes it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand check" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand check" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand check" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand check" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand import" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand import" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand import" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand import" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and not __fish_seen_subcommand_from info cut merge filter help" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and not __fish_seen_subcommand_from info cut merge filter help" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and not __fish_seen_subcommand_from info cut merge filter help" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and not __fish_seen_subcommand_from info cut merge filter help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and not __fish_seen_subcommand_from info cut merge filter help" -f -a "info" -d 'Tell what is in a log: duration, components, messages and their rates, pauses, loss'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and not __fish_seen_subcommand_from info cut merge filter help" -f -a "cut" -d 'Make a log of a part of one'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and not __fish_seen_subcommand_from info cut merge filter help" -f -a "merge" -d 'Make one log of several, in the order of their times'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and not __fish_seen_subcommand_from info cut merge filter help" -f -a "filter" -d 'Make a log of some messages, systems or components of one'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and not __fish_seen_subcommand_from info cut merge filter help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from info" -l dialect -d 'Know the messages of this XML definition file too; may be repeated' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from info" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from info" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from info" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from info" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from cut" -l from -d 'Leave out what is before: 90 or 1m30s after the start, or 2026-11-22T10:30:00 (UTC)' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from cut" -l to -d 'Leave out what is from then on' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from cut" -s o -l output -d 'The new log' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from cut" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from cut" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from cut" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from cut" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from merge" -s o -l output -d 'The new log' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from merge" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from merge" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from merge" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from merge" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -l allow-messages -d 'Only these messages, by name or number' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -l block-messages -d 'Not these messages' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -l allow-systems -d 'Only what these systems sent' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -l block-systems -d 'Not what these systems sent' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -l allow-components -d 'Only what components with these ids sent' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -l block-components -d 'Not what components with these ids sent' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -l dialect -d 'Know the messages of this XML definition file too; may be repeated' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -l from -d 'Leave out what is before: 90 or 1m30s after the start, or 2026-11-22T10:30:00 (UTC)' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -l to -d 'Leave out what is from then on' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -s o -l output -d 'The new log' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from filter" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from help" -f -a "info" -d 'Tell what is in a log: duration, components, messages and their rates, pauses, loss'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from help" -f -a "cut" -d 'Make a log of a part of one'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from help" -f -a "merge" -d 'Make one log of several, in the order of their times'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from help" -f -a "filter" -d 'Make a log of some messages, systems or components of one'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand status" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand status" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand status" -l json -d 'Print one picture as JSON, with counts instead of rates'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand status" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand status" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand status" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand why" -l mavlink -d 'In which version of MAVLink [default: 2]' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand why" -l signed -d 'Whether it is signed; left out, it is where signatures are asked for' -r -f -a "true\t''
false\t''"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand why" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand why" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand why" -l json -d 'Print the answer as JSON'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand why" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand why" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand why" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand listen" -s n -l count -d 'End after so many frames' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand listen" -l dialect -d 'Read the fields of this XML definition file\'s messages too; may be repeated' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand listen" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand listen" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand listen" -l json -d 'Print each frame as a line of JSON'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand listen" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand listen" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand listen" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and not __fish_seen_subcommand_from add change remove enable disable help" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and not __fish_seen_subcommand_from add change remove enable disable help" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and not __fish_seen_subcommand_from add change remove enable disable help" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and not __fish_seen_subcommand_from add change remove enable disable help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and not __fish_seen_subcommand_from add change remove enable disable help" -f -a "add" -d 'Join another endpoint'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and not __fish_seen_subcommand_from add change remove enable disable help" -f -a "change" -d 'Give the endpoint of the same name these settings; links stay where that is possible'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and not __fish_seen_subcommand_from add change remove enable disable help" -f -a "remove" -d 'Close an endpoint and forget it'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and not __fish_seen_subcommand_from add change remove enable disable help" -f -a "enable" -d 'Open an endpoint that was switched off'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and not __fish_seen_subcommand_from add change remove enable disable help" -f -a "disable" -d 'Close an endpoint until it is switched on again'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and not __fish_seen_subcommand_from add change remove enable disable help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from add" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from add" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from add" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from add" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from add" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from change" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from change" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from change" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from change" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from change" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from remove" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from remove" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from remove" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from remove" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from remove" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from enable" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from enable" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from enable" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from enable" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from enable" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from disable" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from disable" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from disable" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from disable" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from disable" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from help" -f -a "add" -d 'Join another endpoint'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from help" -f -a "change" -d 'Give the endpoint of the same name these settings; links stay where that is possible'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from help" -f -a "remove" -d 'Close an endpoint and forget it'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from help" -f -a "enable" -d 'Open an endpoint that was switched off'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from help" -f -a "disable" -d 'Close an endpoint until it is switched on again'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand endpoint; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand top" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand top" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand top" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand top" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand top" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and not __fish_seen_subcommand_from start stop help" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and not __fish_seen_subcommand_from start stop help" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and not __fish_seen_subcommand_from start stop help" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and not __fish_seen_subcommand_from start stop help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and not __fish_seen_subcommand_from start stop help" -f -a "start" -d 'Record telemetry from now on, to the directory that is configured'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and not __fish_seen_subcommand_from start stop help" -f -a "stop" -d 'End the telemetry log, and record no more'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and not __fish_seen_subcommand_from start stop help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from start" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from start" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from start" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from start" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from start" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from stop" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from stop" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from stop" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from stop" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from stop" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from help" -f -a "start" -d 'Record telemetry from now on, to the directory that is configured'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from help" -f -a "stop" -d 'End the telemetry log, and record no more'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand record; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand reload" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand reload" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand reload" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand reload" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand reload" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log-level" -l control -d 'The control socket of the daemon; without it, it is looked for where daemons have it' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log-level" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log-level" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log-level" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand log-level" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -s c -l config -d 'Read this configuration file, and not those in /etc/mavswitch' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l learn -d 'Learn routes from every frame, or from HEARTBEAT only [default: all]' -r -f -a "all\t'Every frame that passed a full check'
heartbeat\t'HEARTBEAT frames'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l strict -d 'Send nothing to components that were never heard, not even to their system\'s links' -r -f -a "true\t''
false\t''"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l route-age -d 'Forget a route that was silent for so many seconds; 0: never [default: 300]' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l sniffer -d 'Send everything to the links on which this system id is heard, whoever it is for' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l dialect -d 'Know the messages of this XML definition file too; may be repeated' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l metrics -d 'Serve metrics for Prometheus, and a status page, by HTTP at this address and port' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l key -d 'A signing key that endpoints may name, and the file that it is in; may be repeated' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l control -d 'Where to have the control socket, by which `mavswitch status` and others ask; off: nowhere' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l system -d 'Be a component of this system: send HEARTBEAT, answer TIMESYNC and PING, measure links' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l component -d 'The component id of that component [default: 191]' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l record -d 'Record all traffic to this directory, as telemetry logs (.tlog)' -r -F
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l record-telemetry -d 'Record all traffic, if there is a directory for it [default: true]' -r -f -a "true\t''
false\t''"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l record-when -d 'When to record [default: always]' -r -f -a "always\t'As long as the program runs'
armed\t'While a vehicle is armed'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l record-max-size -d 'Begin another telemetry log after so many bytes, as 100M; 0: never [default: 0]' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l record-max-time -d 'Begin another telemetry log after so long, as 30m; 0: never [default: 0]' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l record-min-free -d 'Delete the oldest records so that so much of the disk is free; 0: never [default: 100M]' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l record-max-files -d 'Delete the oldest records so that there are no more; 0: never [default: 0]' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l flight-log -d 'Ask vehicles for the logs that they make, and record these as well [default: off]' -r -f -a "off\t'None'
auto\t'What each vehicle makes: ULog of PX4, DataFlash blocks of ArduPilot'
ulog\t'ULog, whatever the vehicle'
dataflash\t'DataFlash blocks, whatever the vehicle'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l flight-log-system -d 'Ask only the vehicle with this system id for its logs' -r
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -l log-format -d 'How log lines look [default: auto]' -r -f -a "auto\t'As `journal` if standard error is the journal of systemd, otherwise as `text`'
text\t'One line of text for each event, with the time'
json\t'One JSON object for each event'
journal\t'Lines with priorities and without the time, for the journal of systemd'
plain\t'One line of text without the time, for another log that adds its own'"
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -s v -l verbose -d 'Log more: what each link carried, and who found no route'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -s q -l quiet -d 'Log only what is wrong; twice: nothing but errors'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand config" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "dialect" -d 'Print the messages that a definition file declares, as rows of the built-in table'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "ports" -d 'List the serial ports of this computer: what each one is, and whether you may open it'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "completions" -d 'Print what a shell needs to complete command lines, for its directory of completions'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "check" -d 'Check a configuration file, and tell what it means and what is missing; opens no endpoint'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "import" -d 'Print what a configuration of mavlink-router means, as a file of mavswitch'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "log" -d 'Work on telemetry logs: info, cut, merge, filter'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "status" -d 'Tell what is going on in a running mavswitch: endpoints, links, components, messages'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "why" -d 'Explain why a frame goes where it goes; without arguments, tell what looks wrong'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "listen" -d 'Print frames as they pass through a running mavswitch, with their fields'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "endpoint" -d 'Add, change, remove, enable or disable an endpoint of a running mavswitch'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "top" -d 'Watch what is going on in a running mavswitch, live on the terminal'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "record" -d 'Have a running mavswitch start or stop to record telemetry'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "reload" -d 'Have a running mavswitch read its configuration anew; if anything is wrong, fail and say what'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "log-level" -d 'Have a running mavswitch log more or less'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "config" -d 'Print the effective configuration, of files and command line together, as a file'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and not __fish_seen_subcommand_from dialect ports completions check import log status why listen endpoint top record reload log-level config help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from log" -f -a "info" -d 'Tell what is in a log: duration, components, messages and their rates, pauses, loss'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from log" -f -a "cut" -d 'Make a log of a part of one'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from log" -f -a "merge" -d 'Make one log of several, in the order of their times'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from log" -f -a "filter" -d 'Make a log of some messages, systems or components of one'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from endpoint" -f -a "add" -d 'Join another endpoint'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from endpoint" -f -a "change" -d 'Give the endpoint of the same name these settings; links stay where that is possible'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from endpoint" -f -a "remove" -d 'Close an endpoint and forget it'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from endpoint" -f -a "enable" -d 'Open an endpoint that was switched off'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from endpoint" -f -a "disable" -d 'Close an endpoint until it is switched on again'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from record" -f -a "start" -d 'Record telemetry from now on, to the directory that is configured'
complete -c mavswitch -n "__fish_mavswitch_using_subcommand help; and __fish_seen_subcommand_from record" -f -a "stop" -d 'End the telemetry log, and record no more'
