//! Two vehicles that arm and disarm, as their heartbeats tell, or start again in mid-flight.

use super::*;

/// A PX4 and an ArduPilot, with their logs.
fn both(messages: usize, blocks: usize) -> (Vec<Pilot>, [Vec<u8>; 2]) {
    let [(px4, log), (ardupilot, other_log)] = [px4(1, messages), ardupilot(2, blocks)];
    (vec![on_a_bad_line(px4), on_a_bad_line(ardupilot)], [log, other_log])
}

/// Each of the vehicles has another log from now on, and knows nothing of what it has sent.
fn replace(stage: &mut Stage, pilots: Vec<Pilot>) {
    for (pilot, other) in stage.pilots.iter_mut().zip(pilots) {
        pilot.vehicle = other.vehicle;
    }
}

/// The contents of the files of a kind, in the order in which they were begun.
fn of_kind(files: &[(String, Vec<u8>)], extension: &str) -> Vec<Vec<u8>> {
    let is_of_kind = |file: &&(String, Vec<u8>)| file.0 == extension;
    files.iter().filter(is_of_kind).map(|file| file.1.clone()).collect()
}

fn phases(stage: &Stage) -> Vec<Phase> {
    stage.collector.progress().iter().map(|it| it.phase).collect()
}

/// A heartbeat a second, until the logs of both vehicles have ended.
fn land(stage: &mut Stage) {
    for _ in 0..60 {
        stage.beat(0);
        stage.run(1_000);
        if phases(stage).iter().all(|phase| *phase == Phase::Idle) {
            return;
        }
    }
    panic!("the logs do not end: {:?}", phases(stage));
}

#[test]
fn a_hundred_armings_of_two_vehicles_at_once_are_a_hundred_whole_files_of_each() {
    let (pilots, _) = both(1, 1);
    let mut stage = Stage::recording(RecordWhen::Armed, pilots);
    stage.beat(0);
    stage.run(100);
    assert_eq!(phases(&stage), [Phase::Idle; 2], "nobody is armed yet");
    let (mut ulogs, mut dataflashes) = (Vec::new(), Vec::new());
    for arming in 0..100 {
        // No two logs are of the same length.
        let (pilots, [ulog, dataflash]) = both(10 + arming, 2 + arming);
        replace(&mut stage, pilots);
        ulogs.push(ulog);
        dataflashes.push(dataflash);
        stage.beat(Heartbeat::ARMED);
        stage.run_to_end();
        stage.beat(Heartbeat::ARMED);
        land(&mut stage);
    }
    let files = stage.end();
    assert_eq!(files.len(), 200);
    assert!(of_kind(&files, "ulg") == ulogs, "the logs of the PX4 are not as it sent them");
    assert!(of_kind(&files, "bin") == dataflashes, "those of the ArduPilot are not");
}

#[test]
fn two_vehicles_that_start_again_in_mid_flight_get_two_files_each() {
    let (pilots, [first_ulog, first_dataflash]) = both(400, 1_000);
    let mut stage = Stage::recording(RecordWhen::Armed, pilots);
    let tell_time = |stage: &mut Stage, since_boot_ms: u32| {
        for system in [1, 2] {
            let mut payload = vec![0; 8];
            payload.extend(since_boot_ms.to_le_bytes());
            stage.hear(&from_autopilot(system, MessageId::SYSTEM_TIME, 137, &payload));
        }
    };
    stage.greet();
    tell_time(&mut stage, 90_000);
    stage.run(1_500);
    assert_eq!(phases(&stage), [Phase::Running; 2]);
    let (pilots, [ulog, dataflash]) = both(150, 300);
    replace(&mut stage, pilots);
    // What they sent before is lost with them.
    stage.pilots.iter_mut().for_each(|pilot| pilot.line.clear());
    tell_time(&mut stage, 1_000);
    stage.run_to_end();
    let files = stage.end();
    let [ulogs, dataflashes] = ["ulg", "bin"].map(|extension| of_kind(&files, extension));
    assert_eq!((ulogs.len(), dataflashes.len()), (2, 2));
    assert!(first_ulog.starts_with(&ulogs[0]) && ulogs[0].len() > 1_000);
    // Blocks that were missing when it started again stay so.
    assert!(first_dataflash.len() > dataflashes[0].len() && dataflashes[0].len() > 20_000);
    assert!(ulogs[1] == ulog && dataflashes[1] == dataflash);
}
