//! A frame with its grid, its ticks and the names of its axes.

use svg::node::element::Element;

use crate::axis::Axis;
use crate::plot::{Anchor, At, GREY, NAME, NUMBER, fitting, length, line, text, upwards};

const GRID: &str = "#E5E5E5";
const WIDTH: f64 = 0.8;
/// The length of a tick, and the room between it and its number.
const TICK: f64 = 4.0;
const GAP: f64 = 3.0;
/// The distance of the baseline of the vertical name from the edge.
const NAME_LEFT: f64 = 15.0;
/// The room between the vertical name and the numbers. Some fonts are wider than the estimate.
const NAME_RIGHT: f64 = 14.0;
/// The distance of the horizontal name from the frame.
const NAME_BELOW: f64 = 32.0;

/// The size of a frame, and the room around it.
pub(crate) struct Room {
    pub(crate) frame: At,
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) top: f64,
    pub(crate) below: f64,
}

impl Room {
    /// Width and height of all.
    pub(crate) fn size(&self) -> At {
        (self.left + self.frame.0 + self.right, self.top + self.frame.1 + self.below)
    }

    /// The room to the left of a frame: for the numbers along its axis, and their name.
    pub(crate) fn left_of(y: &Axis) -> f64 {
        let widest = y.ticks().iter().map(|(_, number)| length(number, NUMBER)).fold(0.0, f64::max);
        (NAME_LEFT + NAME_RIGHT + widest + GAP + TICK).ceil()
    }
}

/// A pair of axes around a frame.
pub(crate) struct Frame<'a> {
    pub(crate) room: &'a Room,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
}

impl Frame<'_> {
    /// The place of a point, with the upper left corner of the room at the origin.
    pub(crate) fn at(&self, (x, y): At) -> At {
        let (room, frame) = (self.room, self.room.frame);
        (room.left + frame.0 * self.x.place(x), room.top + frame.1 * (1.0 - self.y.place(y)))
    }

    /// A dashed line from side to side.
    pub(crate) fn level(&self, y: f64, color: &str) -> Element {
        let (left, y) = (self.room.left, self.at((0.0, y)).1);
        line([(left, y), (left + self.room.frame.0, y)], color, 1.0, Some("5 4"))
    }

    /// The grid, the box, the ticks with their numbers, and the names of the axes.
    pub(crate) fn parts(&self, [horizontal, vertical]: [&str; 2]) -> Vec<Element> {
        let [left, top] = [self.room.left, self.room.top];
        let (right, bottom) = (left + self.room.frame.0, top + self.room.frame.1);
        let mut grid = Vec::new();
        let mut ticks = Vec::new();
        let stroke = |a, b, color| line([a, b], color, WIDTH, None);
        for (value, number) in self.x.ticks() {
            let x = left + self.room.frame.0 * self.x.place(value);
            grid.push(stroke((x, top), (x, bottom), GRID));
            ticks.push(stroke((x, bottom), (x, bottom + TICK), GREY));
            let below = bottom + TICK + 0.6 * f64::from(NUMBER);
            ticks.push(text(&number, (x, below), NUMBER, Anchor::Middle).into());
        }
        for (value, number) in self.y.ticks() {
            let y = top + self.room.frame.1 * (1.0 - self.y.place(value));
            grid.push(stroke((left, y), (right, y), GRID));
            ticks.push(stroke((left - TICK, y), (left, y), GREY));
            ticks.push(text(&number, (left - TICK - GAP, y), NUMBER, Anchor::End).into());
        }
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
        grid.push(line(corners, GREY, WIDTH, None));
        grid.extend(ticks);
        let (middle, height) = (0.5 * (left + right), self.room.frame.1 + 24.0);
        grid.push(text(horizontal, (middle, bottom + NAME_BELOW), NAME, Anchor::Middle).into());
        let size = fitting(vertical, NAME, height);
        grid.push(upwards(vertical, (NAME_LEFT, 0.5 * (top + bottom)), size).into());
        grid
    }
}
