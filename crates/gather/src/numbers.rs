//! Structs as arrays of numbers, for the columns in `path_trace/columns.rs`.

/// Gives a struct `NUMBERS` (the count of numbers in it), `to_array` and `from_array`. The macro
/// lists the struct's fields in array order, each with its kind. A kind is `f32`, `u32`, `bool`,
/// `pair` (two numbers), `Vec3` or `Mat3`. All indices are constants, so the compiler vectorises
/// loops over columns.
macro_rules! numbers {
    ($of:ident of $number:ty { $($field:ident: $kind:tt),+ $(,)? }) => {
        impl $of {
            pub(crate) const NUMBERS: usize = 0 $(+ numbers!(@count $kind))+;

            #[inline(always)]
            pub(crate) fn to_array(self) -> [$number; Self::NUMBERS] {
                let value = self;
                numbers!(@put value [] $($field: $kind,)+)
            }

            #[inline(always)]
            pub(crate) fn from_array(numbers: [$number; Self::NUMBERS]) -> Self {
                numbers!(@take numbers (0) [] $($field: $kind,)+)
            }
        }
    };

    (@count f32) => { 1 };
    (@count u32) => { 1 };
    (@count bool) => { 1 };
    (@count pair) => { 2 };
    (@count Vec3) => { 3 };
    (@count Mat3) => { 9 };

    (@put $value:ident [$($numbers:tt)*]) => { [$($numbers)*] };
    (@put $value:ident [$($numbers:tt)*] $field:ident: bool, $($rest:tt)*) => {
        numbers!(@put $value [$($numbers)* f32::from($value.$field),] $($rest)*)
    };
    (@put $value:ident [$($numbers:tt)*] $field:ident: pair, $($rest:tt)*) => {
        numbers!(@put $value [$($numbers)* $value.$field[0], $value.$field[1],] $($rest)*)
    };
    (@put $value:ident [$($numbers:tt)*] $field:ident: Vec3, $($rest:tt)*) => {
        numbers!(
            @put $value
            [$($numbers)* $value.$field.x, $value.$field.y, $value.$field.z,]
            $($rest)*
        )
    };
    (@put $value:ident [$($numbers:tt)*] $field:ident: Mat3, $($rest:tt)*) => {
        numbers!(
            @put $value
            [
                $($numbers)*
                $value.$field.x_axis.x, $value.$field.x_axis.y, $value.$field.x_axis.z,
                $value.$field.y_axis.x, $value.$field.y_axis.y, $value.$field.y_axis.z,
                $value.$field.z_axis.x, $value.$field.z_axis.y, $value.$field.z_axis.z,
            ]
            $($rest)*
        )
    };
    (@put $value:ident [$($numbers:tt)*] $field:ident: $number:ident, $($rest:tt)*) => {
        numbers!(@put $value [$($numbers)* $value.$field,] $($rest)*)
    };

    (@take $from:ident ($($at:tt)+) [$($fields:tt)*]) => { Self { $($fields)* } };
    (@take $from:ident ($($at:tt)+) [$($fields:tt)*] $field:ident: bool, $($rest:tt)*) => {
        numbers!(
            @take $from ($($at)+ + 1)
            [$($fields)* $field: $from[$($at)+] != 0.0,]
            $($rest)*
        )
    };
    (@take $from:ident ($($at:tt)+) [$($fields:tt)*] $field:ident: pair, $($rest:tt)*) => {
        numbers!(
            @take $from ($($at)+ + 2)
            [$($fields)* $field: [$from[$($at)+], $from[$($at)+ + 1]],]
            $($rest)*
        )
    };
    (@take $from:ident ($($at:tt)+) [$($fields:tt)*] $field:ident: Vec3, $($rest:tt)*) => {
        numbers!(
            @take $from ($($at)+ + 3)
            [$($fields)* $field: numbers!(@vector $from $($at)+),]
            $($rest)*
        )
    };
    (@take $from:ident ($($at:tt)+) [$($fields:tt)*] $field:ident: Mat3, $($rest:tt)*) => {
        numbers!(
            @take $from ($($at)+ + 9)
            [
                $($fields)*
                $field: Mat3::from_cols(
                    numbers!(@vector $from $($at)+),
                    numbers!(@vector $from $($at)+ + 3),
                    numbers!(@vector $from $($at)+ + 6),
                ),
            ]
            $($rest)*
        )
    };
    (@take $from:ident ($($at:tt)+) [$($fields:tt)*] $field:ident: $number:ident, $($rest:tt)*) => {
        numbers!(@take $from ($($at)+ + 1) [$($fields)* $field: $from[$($at)+],] $($rest)*)
    };

    (@vector $from:ident $($at:tt)+) => {
        Vec3::new($from[$($at)+], $from[$($at)+ + 1], $from[$($at)+ + 2])
    };
}

pub(crate) use numbers;
