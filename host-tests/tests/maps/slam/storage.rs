//! A map in flash: saved, loaded, gone on with; the power cut at every write; damaged.

use beamfix::slam::{Slam, SlamConfig, StorageError};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use host_tests::mapping::building::{ROUND, ring};

use super::drive::{Driven, drive, path};

type Small = Slam<100, 200, 400, 144, 360>;

/// A bank has room for the largest map: 32 units of 1 KB.
const SIZE: usize = 2 * 40 * 1024;
const RANGE: std::ops::Range<u32> = 0..SIZE as u32;

/// Flash in memory whose power is cut after so many erasures and writes.
#[derive(Clone)]
struct Flash {
    bytes: Vec<u8>,
    left: usize,
    done: usize,
}

#[derive(Debug, PartialEq)]
struct Dead;

impl NorFlashError for Dead {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Flash {
    fn new() -> Self {
        Self {
            bytes: vec![0x5a; SIZE],
            left: usize::MAX,
            done: 0,
        }
    }

    /// How much of the next operation on so many bytes is done.
    fn spend(&mut self, count: usize) -> (usize, Result<(), Dead>) {
        if self.left == 0 {
            return (0, Err(Dead));
        }
        self.left -= 1;
        self.done += 1;
        match self.left {
            0 => (count / 2, Err(Dead)),
            _ => (count, Ok(())),
        }
    }
}

impl ErrorType for Flash {
    type Error = Dead;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Dead> {
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Dead> {
        assert!(from.is_multiple_of(1024) && to.is_multiple_of(1024));
        let (count, result) = self.spend((to - from) as usize);
        self.bytes[from as usize..][..count].fill(0xff);
        result
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Dead> {
        assert!(offset.is_multiple_of(8) && bytes.len().is_multiple_of(8));
        let (count, result) = self.spend(bytes.len());
        for (to, from) in self.bytes[offset as usize..]
            .iter_mut()
            .zip(&bytes[..count])
        {
            assert_eq!(*to, 0xff, "written twice");
            *to = *from;
        }
        result
    }
}

fn empty() -> Box<Small> {
    Box::new(Small::new(SlamConfig::DEFAULT))
}

/// A map of a round, and what became of the drive.
fn mapped(rounds: usize, seed: u64) -> (Box<Small>, Driven) {
    let mut slam = empty();
    let driven = drive(&mut slam, &ring(), &path(&ROUND, rounds), 0.002, seed);
    (slam, driven)
}

/// All that a map is, as text.
fn told(slam: &Small) -> String {
    let nodes: Vec<_> = slam.graph().nodes().collect();
    format!("{nodes:?} {:?}", slam.graph().edges())
}

#[test]
fn a_map_is_gone_on_with_after_power_was_lost() {
    assert!(Small::FLASH_BYTES <= SIZE as u32);
    let (slam, _) = mapped(1, 1);
    let mut flash = Flash::new();
    slam.save(&mut flash, RANGE).expect("saved");
    let mut again = empty();
    again.load(&mut flash, RANGE).expect("loaded");
    assert_eq!(told(&again), told(&slam));
    // The robot starts again where the round ended, half a metre on.
    let truth: Vec<_> = path(&ROUND, 1).split_off(2);
    let driven = drive(&mut again, &ring(), &truth, 0.002, 2);
    let (mapped, _) = driven.errors(&truth);
    let counters = again.counters();
    println!("{mapped} m: {counters:?}");
    assert!(counters.loops > 20, "{counters:?}");
    // As in the drives that are not interrupted.
    assert!(mapped < 0.5, "{mapped} m: {counters:?}");
}

#[test]
fn the_power_is_cut_at_every_write() {
    let ((old, _), (new, _)) = (mapped(1, 1), mapped(1, 2));
    let (old_told, new_told) = (told(&old), told(&new));
    let mut before = Flash::new();
    old.save(&mut before, RANGE).expect("saved");
    let mut whole = before.clone();
    whole.done = 0;
    new.save(&mut whole, RANGE).expect("saved");
    println!("{} erasures and writes", whole.done);
    let mut slam = empty();
    for cut in 0..=whole.done {
        let mut flash = Flash {
            left: cut,
            ..before.clone()
        };
        let saved = new.save(&mut flash, RANGE);
        assert_eq!(saved, Err(StorageError::Flash(Dead)), "cut {cut}");
        slam.load(&mut flash, RANGE)
            .expect("the old one or the new one");
        let found = told(&slam);
        // Of the last write, the header's, half a page is all of it.
        let expected = if cut == whole.done {
            &new_told
        } else {
            &old_told
        };
        assert!(found == *expected, "cut {cut}");
        // And it can be saved again.
        flash.left = usize::MAX;
        new.save(&mut flash, RANGE).expect("saved");
        slam.load(&mut flash, RANGE).expect("loaded");
        assert!(told(&slam) == new_told, "cut {cut}, saved again");
    }
}

#[test]
fn a_damaged_image_is_refused() {
    let (map, _) = mapped(1, 3);
    let whole = told(&map);
    let mut flash = Flash::new();
    let mut slam = empty();
    assert_eq!(slam.load(&mut flash, RANGE), Err(StorageError::NoMap));
    map.save(&mut flash, RANGE).expect("saved");
    let mut refused = 0;
    for place in (0..SIZE / 2).step_by(131) {
        let mut damaged = flash.clone();
        damaged.bytes[place] ^= 1 << (place % 8);
        match slam.load(&mut damaged, RANGE) {
            Err(StorageError::NoMap) => refused += 1,
            // Behind the map, or in the rest of the header's page.
            Ok(()) => assert!(told(&slam) == whole, "byte {place}"),
            other => panic!("byte {place}: {other:?}"),
        }
    }
    println!("{refused} refused");
    assert!(refused > 100, "{refused}");
    // Of another size, in too little room, across units.
    let mut other = Box::new(Slam::<100, 200, 400, 180, 360>::new(SlamConfig::DEFAULT));
    assert_eq!(other.load(&mut flash, RANGE), Err(StorageError::NoMap));
    let small = map.save(&mut flash, 0..16 * 1024);
    assert!(
        matches!(small, Err(StorageError::TooSmall { .. })),
        "{small:?}"
    );
    let across = map.save(&mut flash, 512..SIZE as u32 - 512);
    assert_eq!(across, Err(StorageError::Unaligned));
    slam.load(&mut flash, RANGE).expect("nothing was touched");
}
