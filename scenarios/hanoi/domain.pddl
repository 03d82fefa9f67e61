; The tower of Hanoi with three plates (paper A, section VII-A).
(define (domain hanoi)
  (:requirements :strips :typing :equality :negative-preconditions :universal-preconditions :conditional-effects)
  (:types
    physobj - object
    movable - physobj)
  (:constants platform_left platform_middle platform_right - physobj)
  (:predicates
    (inhand ?a - movable)                 ; the hand holds a
    (on ?a - movable ?b - physobj)        ; a rests on b
    (smaller ?a - physobj ?b - physobj))  ; a may rest on b

  ; Nothing is in the hand, and nothing stands on a.
  (:action pick
    :parameters (?a - movable)
    :precondition (forall (?b - movable) (and (not (inhand ?b)) (not (on ?b ?a))))
    :effect (and
      (inhand ?a)
      (forall (?b - physobj) (not (on ?a ?b)))))

  (:action place
    :parameters (?a - movable ?b - physobj)
    :precondition (and
      (inhand ?a)
      (smaller ?a ?b)
      (forall (?c - movable) (not (on ?c ?b))))
    :effect (and
      (not (inhand ?a))
      (on ?a ?b))))
